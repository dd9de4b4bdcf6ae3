"""A six-axis arm from its published Denavit-Hartenberg table, with errors, a tracker and noise of its own; shares nothing with flexcal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

A = np.array([0.0, -0.425, -0.39225, 0.0, 0.0, 0.0])
D = np.array([0.089159, 0.0, 0.0, 0.10915, 0.09465, 0.0823 + 0.031])
ALPHA = np.array([np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0])
"""Universal Robots UR5, as the manufacturer publishes it; the last d has a reflector before the flange."""


@dataclass(frozen=True)
class DHArm:
    """Arm with `errors` (4, 6) of its DH parameters, before a tracker, with `noise` (m)."""

    errors: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    noise: float
    rng: np.random.Generator

    @classmethod
    def drawn(cls, seed: int, *, noise: float = 5e-5, size: float = 1.0) -> DHArm:
        """Arm with angles off by 1 mrad and lengths by 0.5 mm (1σ), times `size`, before a tracker that stands anywhere."""
        rng = np.random.default_rng([seed, 11])
        errors = rng.standard_normal((4, 6)) * np.array([1e-3, 5e-4, 5e-4, 1e-3])[:, None] * size
        axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        axes *= np.sign(np.linalg.det(axes))
        return cls(errors, axes, rng.uniform(-2, 2, 3), noise, rng)

    def point(self, q: np.ndarray) -> np.ndarray:
        """Reflector (3,), m, in the tracker's frame at joint angles (6,), rad."""
        place = np.eye(4)
        dtheta, dd, da, dalpha = self.errors
        for k in range(6):
            ct, st = np.cos(q[k] + dtheta[k]), np.sin(q[k] + dtheta[k])
            ca, sa = np.cos(ALPHA[k] + dalpha[k]), np.sin(ALPHA[k] + dalpha[k])
            a, d = A[k] + da[k], D[k] + dd[k]
            place = place @ np.array(
                [
                    [ct, -st * ca, st * sa, a * ct],
                    [st, ct * ca, -ct * sa, a * st],
                    [0, sa, ca, d],
                    [0, 0, 0, 1],
                ]
            )
        return self.rotation @ place[:3, 3] + self.translation

    def poses(self, count: int) -> np.ndarray:
        """Random joint angles (count, 6)."""
        return self.rng.uniform(-2.5, 2.5, (count, 6))

    def measured(self, q: np.ndarray) -> np.ndarray:
        """Measured points (N, 3), m."""
        points = np.array([self.point(one) for one in q])
        return points + self.noise * self.rng.standard_normal(points.shape)


UP = np.array([0.6, 0.0, 0.8])
"""Direction of what happens to the tracker."""
FAULTS = ("clean", "joints", "swapped", "sign", "unit", "moved", "turned", "outlier", "drift", "repeat")


def series(fault: str, seed: int, count: int = 40) -> tuple[np.ndarray, np.ndarray, int]:
    """Joint angles (N, 6) and measured points (N, 3) of a series with one fault, and the row from which it can show.

    "moved": the tracker by 0.5 mm before row 15; "turned": by 1 mrad about the points' middle; "outlier": one row by 1 mm; "drift": 10 µm
    a row; "joints": one row with the joint angles of the row before; "swapped": x and y, "sign": of y, "unit": a row in mm.
    The noise is 0.05 mm.
    """
    arm = DHArm.drawn(seed)
    q = arm.poses(count)
    points, row = arm.measured(q), int(np.random.default_rng(seed).integers(20, count - 5))
    if fault == "joints":
        q[row] = q[row - 1]
    elif fault == "swapped":
        points[row] = points[row][[1, 0, 2]]
    elif fault == "sign":
        points[row, 1] *= -1
    elif fault == "unit":
        points[row] *= 1000
    elif fault == "moved":
        row = 15
        points[row:] += 5e-4 * UP
    elif fault == "turned":
        row = 15
        points[row:] += np.cross(1e-3 * UP, points[row:] - points[:row].mean(axis=0))
    elif fault == "outlier":
        points[row] += 1e-3 * UP
    elif fault == "drift":
        row = 0
        points += np.arange(count)[:, None] * 1e-5 * UP
    elif fault == "repeat":
        q[row] = q[row - 7]
        points[row] = arm.measured(q[row : row + 1])[0]
    return q, points, row
