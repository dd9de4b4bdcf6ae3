"""An arm of strangers whose joints yield under the weight of its links, with a tool whose tip and reflector are anywhere.

Torques are sums of moments about the axes as they lie; nothing is shared with flexcal.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from stranger_arm import SIX, StrangerArm, rigid, rodrigues

LINK = 2.0
"""Mass of each link at the origin of its frame, kg, as `StrangerArm.write` has it."""


@dataclass
class YieldingArm(StrangerArm):
    """Joints turn by `compliance` (rad per N m) times the torque of gravity; `tip` is the true place of the tip in tool0."""

    axes: tuple = tuple(SIX)
    compliance: float = 1e-5
    tip: tuple[float, float, float] = (-0.02, 0.03, 0.15)

    def tool(self, q: np.ndarray, *, true: bool) -> np.ndarray:
        if not true:
            return super().tool(q, true=False)
        rows = np.atleast_2d(q)
        return super().tool(rows + self.compliance * self.gravity_torque(rows), true=True)

    def gravity_torque(self, q: np.ndarray) -> np.ndarray:
        """Torque (N, n) of the links' weight about each axis, N m."""
        found = np.zeros((len(q), self.n))
        for k, row in enumerate(q):
            at, axes, centres = np.eye(4), [], []
            for angle, d, origin in zip(row, self.direction, self.origin, strict=True):
                axes.append((at[:3, :3] @ d, at[:3, :3] @ origin + at[:3, 3]))
                turned = rodrigues(d, angle)
                at = at @ rigid(turned, origin - turned @ origin)
                centres.append(at[:3, :3] @ origin + at[:3, 3])
            for i, (axis, foot) in enumerate(axes):
                moments = [np.cross(centre - foot, [0, 0, -9.81 * LINK]) for centre in centres[i:]]
                found[k, i] = axis @ np.sum(moments, axis=0)
        return found

    def at(self, q: np.ndarray, xyz: np.ndarray, *, true: bool = True) -> np.ndarray:
        """A point (N, 3) of tool0 in the base frame, m."""
        return (self.tool(q, true=true) @ np.append(xyz, 1.0))[:, :3]

    def brought(self, xyz: np.ndarray, place: np.ndarray, q: np.ndarray) -> np.ndarray | None:
        """Joint positions near `q` at which a true point of tool0 is at a place."""
        for _ in range(30):
            off = self.at(q, xyz)[0] - place
            if np.linalg.norm(off) < 1e-11:
                return q
            slope = ((self.at(q + 1e-6 * np.eye(self.n), xyz) - place - off) / 1e-6).T
            q = q - np.linalg.lstsq(slope, off, rcond=None)[0]
            if np.abs(q).max() > 3:
                return None
        return None


def touches(
    arm: YieldingArm,
    path: Path,
    places: list[tuple[str, np.ndarray]],
    rng: np.random.Generator,
    noise: float = 1e-5,
) -> Path:
    """A file of poses in which the tip touched named places (m, base frame) with the tool in other orientations."""
    tip = np.array(arm.tip)
    rows = [",".join([*(f"q{i + 1}" for i in range(arm.n)), "point"])]
    start = None
    while start is None:
        start = arm.brought(tip, places[0][1], arm.postures(1, rng, 0.3)[0])
    for name, place in places:
        q = None
        while q is None:
            turned = start + rng.uniform(-1, 1, 6) * [0.1, 0.15, 0.15, 0.6, 0.5, 1.0]
            q = arm.brought(tip, place + noise * rng.normal(size=3), turned)
        rows.append(",".join([*map(repr, q.tolist()), name]))
    path.write_text("\n".join(rows) + "\n")
    return path
