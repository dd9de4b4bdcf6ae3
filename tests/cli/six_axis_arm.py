"""A six-joint arm with a spherical wrist: its own kinematics in closed form, its URDF, and measurements of a true one that differs.

At generic joint positions zero the lower arm is upright and the forearm level along x; axes 1 to 6 turn about z, y, y, x, y, x.
A maker's controller counts q = sign · generic + zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

_AXES = ("z", "y", "y", "x", "y", "x")


def turn(axis: str, angle: float) -> np.ndarray:
    """Rotation about an axis of coordinates."""
    c, s = np.cos(angle), np.sin(angle)
    if axis == "x":
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    if axis == "y":
        return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def frame(rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Homogeneous matrix."""
    return np.block([[rotation, np.reshape(position, (3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])


@dataclass(frozen=True)
class Arm:
    """Lengths: axis 2 before axis 1 and above the base, lower arm, axis 4 above axis 3, forearm, flange; limits and counting, degrees."""

    shoulder: float
    height: float
    lower: float
    above: float
    forearm: float
    flange: float
    signs: tuple[float, ...]
    zeros: tuple[float, ...]
    limits: tuple[tuple[float, float], ...]
    errors: np.ndarray | None = None
    """Six numbers a joint (6, 6), m and rad: displacement before its axis."""

    @property
    def places(self) -> np.ndarray:
        """Displacements (7, 3) from each axis to the next, and to the flange."""
        return np.array(
            [
                [0, 0, 0],
                [self.shoulder, 0, self.height],
                [0, 0, self.lower],
                [0, 0, self.above],
                [self.forearm, 0, 0],
                [0, 0, 0],
                [self.flange, 0, 0],
            ]
        )

    def generic(self, q: np.ndarray) -> np.ndarray:
        """Generic joint positions, rad, of those of the controller, degrees."""
        return np.deg2rad((np.array(q) - self.zeros) * self.signs)

    def counted(self, q: np.ndarray) -> np.ndarray:
        """Joint positions of the controller, degrees."""
        return np.rad2deg(q) * self.signs + self.zeros

    def flange_at(self, q: np.ndarray) -> np.ndarray:
        """Matrix of the flange, z outward, at joint positions of the controller."""
        at = np.eye(4)
        for k, angle in enumerate(self.generic(q)):
            at = at @ frame(np.eye(3), self.places[k])
            if self.errors is not None:
                x, y, z, a, b, c = self.errors[k]
                at = at @ frame(turn("x", a) @ turn("y", b) @ turn("z", c), np.array([x, y, z]))
            at = at @ frame(turn(_AXES[k], angle), np.zeros(3))
        return at @ frame(turn("y", np.pi / 2), self.places[6])

    def solutions(self, goal: np.ndarray) -> list[tuple[np.ndarray, bool, bool]]:
        """Joint positions of the controller at a flange, in closed form: with wrist centre behind axis 1, and behind the lower arm."""
        goal = goal @ frame(turn("y", -np.pi / 2), np.zeros(3))
        centre = goal[:3, 3] - self.flange * goal[:3, 0]
        long = np.hypot(self.above, self.forearm)
        bent = np.arctan2(self.above, self.forearm)
        found = []
        for side in (0.0, np.pi):
            q1 = np.arctan2(centre[1], centre[0]) + side
            out = np.cos(q1) * centre[0] + np.sin(q1) * centre[1]
            r, z = out - self.shoulder, centre[2] - self.height
            cosine = (r * r + z * z - self.lower**2 - long**2) / (2 * self.lower * long)
            if abs(cosine) > 1:
                continue
            for bend in (np.arccos(cosine), -np.arccos(cosine)):
                # from the upright lower arm the line to the wrist centre turns forward by `bend`
                q3 = bend - np.pi / 2 + bent
                q2 = np.arctan2(r, z) - np.arctan2(long * np.sin(bend), self.lower + long * np.cos(bend))
                wrist = (turn("z", q1) @ turn("y", q2 + q3)).T @ goal[:3, :3]
                for flip in (1.0, -1.0):
                    q5 = flip * np.arctan2(np.hypot(wrist[0, 1], wrist[0, 2]), wrist[0, 0])
                    q4 = np.arctan2(flip * wrist[1, 0], -flip * wrist[2, 0])
                    q6 = np.arctan2(flip * wrist[0, 1], flip * wrist[0, 2])
                    q = np.array([q1, q2, q3, q4, q5, q6])
                    q = np.arctan2(np.sin(q), np.cos(q))
                    found.append((self.counted(q), out < 0, bend < 0))
        return found

    def whole_turns(self, goal: np.ndarray) -> list[tuple[np.ndarray, bool, bool]]:
        """Solutions with whole turns of every joint, within the limits."""
        several = []
        for q, behind, below in self.solutions(goal):
            choices = [
                [v + 360 * k for k in (-2, -1, 0, 1, 2) if low - 1e-6 <= v + 360 * k <= high + 1e-6]
                for v, (low, high) in zip(q, self.limits, strict=True)
            ]
            grid = np.meshgrid(*choices, indexing="ij")
            several += [(np.array(row), behind, below) for row in np.stack(grid, axis=-1).reshape(-1, 6)]
        return several

    def true_one(self, seed: int) -> Arm:
        """Errors of 0.3 mm and 0.5 mrad before axes 2 to 5; where the base stands and the last joint would be the frames' as well."""
        rng = np.random.default_rng(seed)
        errors = np.column_stack([rng.normal(0, 3e-4, (6, 3)), rng.normal(0, 5e-4, (6, 3))])
        errors[[0, 5]] = 0.0
        return replace(self, errors=errors)

    def urdf(self, *, counted: bool = True) -> str:
        """URDF that counts joint positions as the controller does, or generically."""
        signs, zeros = (self.signs, self.zeros) if counted else ((1.0,) * 6, (0.0,) * 6)
        parts = ['<robot name="arm"><link name="base_link"/>']
        for k in range(6):
            parent = "base_link" if k == 0 else f"link_{k}"
            axis = signs[k] * np.eye(3)["xyz".index(_AXES[k])]
            rpy = np.zeros(3)
            rpy["xyz".index(_AXES[k])] = -signs[k] * np.deg2rad(zeros[k])
            low, high = self.limits[k]
            if not counted:
                low, high = sorted(np.rad2deg(self.generic(np.full(6, end))[k]) for end in (low, high))
            parts.append(
                f'<link name="link_{k + 1}"/><joint name="joint_{k + 1}" type="revolute"><parent link="{parent}"/>'
                f'<child link="link_{k + 1}"/><origin xyz="{_text(self.places[k])}" rpy="{_text(rpy)}"/><axis xyz="{_text(axis)}"/>'
                f'<limit lower="{np.deg2rad(low):.9f}" upper="{np.deg2rad(high):.9f}" effort="1" velocity="1"/></joint>'
            )
        parts.append(
            '<link name="tool0"/><joint name="flange" type="fixed"><parent link="link_6"/><child link="tool0"/>'
            f'<origin xyz="{_text(self.places[6])}" rpy="0 {np.pi / 2:.15f} 0"/></joint></robot>'
        )
        return "\n".join(parts)

    def measured(self, folder: Path, tool: np.ndarray, *, counted: bool = True) -> None:
        """Write robot.yaml, the URDF, 80 measured positions of a tool of this arm for calibration and 40 for verification."""
        (folder / "arm.urdf").write_text(self.urdf(counted=counted), "utf-8")
        (folder / "robot.yaml").write_text(
            f"robot: arm.urdf\npoints:\n  smr: {{frame: tool0, xyz: [{', '.join(map(str, tool))}]}}\n",
            "utf-8",
        )
        rng = np.random.default_rng(8)
        for name, count in (("points", 80), ("others", 40)):
            rows = ["pose,q1,q2,q3,q4,q5,q6,x,y,z"]
            for k in range(count):
                low, high = np.array(self.limits).T
                q = self.middle() + rng.uniform(-45, 45, 6)
                q = np.clip(q, low, high)
                at = (self.flange_at(q) @ np.array([*tool, 1.0]))[:3] + rng.normal(0, 1.5e-5, 3)
                shown = np.deg2rad(q) if counted else self.generic(q)
                rows.append(",".join([str(k), *map(repr, shown.tolist()), *map(repr, at.tolist())]))
            (folder / f"{name}.csv").write_text("\n".join(rows) + "\n", "utf-8")

    def middle(self) -> np.ndarray:
        """Joint positions of the controller, degrees, in front of the arm with the flange downward."""
        return self.counted(np.deg2rad([10.0, 15.0, 10.0, 5.0, 60.0, 20.0]))


def _text(values: np.ndarray) -> str:
    return " ".join(f"{value:.12g}" for value in np.asarray(values) + 0.0)


def registered(at: np.ndarray, goals: np.ndarray) -> np.ndarray:
    """Distances (N,) of positions from goals after the best rigid motion: where the base stands, points of a tracker do not tell."""
    mean, aim = at.mean(axis=0), goals.mean(axis=0)
    left, _, right = np.linalg.svd((at - mean).T @ (goals - aim))
    best = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    return np.linalg.norm((at - mean) @ best - (goals - aim), axis=1)


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """Quaternion w, x, y, z as the eigenvector of Bar-Itzhack's matrix."""
    r = rotation
    matrix = np.array(
        [
            [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )
    return np.linalg.eigh(matrix)[1][:, -1]


def turned_by(wxyz: np.ndarray) -> np.ndarray:
    """Rotation of a quaternion."""
    w, v = wxyz[0] / np.linalg.norm(wxyz), np.array(wxyz[1:]) / np.linalg.norm(wxyz)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross


IRB120 = Arm(
    0.0,
    0.290,
    0.270,
    0.070,
    0.302,
    0.072,
    (1.0,) * 6,
    (0.0,) * 6,
    ((-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-400, 400)),
)
"""Lengths and limits of an IRB 120 as ABB's data sheet has them."""
KR6 = Arm(
    0.025,
    0.400,
    0.455,
    0.035,
    0.420,
    0.080,
    (-1.0, 1.0, 1.0, -1.0, 1.0, -1.0),
    (0.0, -90.0, 90.0, 0.0, 0.0, 0.0),
    ((-170, 170), (-190, 45), (-120, 156), (-185, 185), (-120, 120), (-350, 350)),
)
"""Lengths and limits of a KR 6 R900 as KUKA's data sheet has them."""
