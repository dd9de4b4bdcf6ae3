"""A SCARA whose quill hangs on a ball screw spline, and a tracker, with nothing of flexcal in them.

Two arms turn about vertical axes; in the second a nut lifts a spindle, which a spline turns: the spindle rises by the nut's travel less the
lead of the screw for every turn of its own. Column and elbow tilt under the weight of what they carry.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from palletiser import turn

LIMITS = np.array([[-2.2, 2.2], [-2.5, 2.5], [-0.18, 0.0], [-3.1, 3.1]])
HEIGHT, UPPER, FORE, DROP = 0.38, 0.35, 0.30, 0.05
LEAD = 0.020 / (2 * np.pi)
"""m of travel per radian of the spindle."""
MASSES = np.array([9.0, 7.0, 1.5])
"""kg: upper arm, forearm with the motors, spindle."""
PAYLOAD = 4.0
REFLECTOR = np.array([0.06, 0.015, -0.03])
TILT = np.array([6e4, 4e4])
"""N m/rad of column and elbow about every horizontal axis."""
GRAVITY = 9.81
TRACKER = 0.02e-3


@dataclass(frozen=True)
class Scara:
    """One as built: zeros of its four motors (rad, m), lengths of the arms (m), leaning axes (rad), lead (m/rad), stiffness (N m/rad)."""

    zero: np.ndarray
    lengths: np.ndarray
    lean: np.ndarray
    lead: float
    tilt: np.ndarray

    @classmethod
    def nominal(cls) -> Scara:
        """As drawn, and stiff."""
        return cls(np.zeros(4), np.zeros(3), np.zeros((3, 2)), LEAD, np.full(2, np.inf))

    @classmethod
    def drawn(cls, seed: int) -> Scara:
        """As built."""
        rng = np.random.default_rng([seed, 4])
        return cls(
            np.array([2e-3, 3e-3, 5e-4, 4e-3]) * rng.normal(size=4),
            4e-4 * rng.normal(size=3),
            8e-4 * rng.normal(size=(3, 2)),
            LEAD * (1 + 2e-3 * rng.normal()),
            TILT * np.exp(0.3 * rng.normal(size=2)),
        )

    def reflector(self, q: np.ndarray) -> np.ndarray:
        """Where the reflector is (N, 3), m, in the base frame with the motors at `q` (N, 4), its column and elbow bent by gravity."""
        bend = np.zeros((len(q), 2, 2))
        for _ in range(40):
            arms, at, points = self._points(q, bend)
            weights = [*MASSES, PAYLOAD]
            step = np.zeros_like(bend)
            for k in range(2):
                moment = sum(
                    np.cross(p - at[k], [0, 0, -GRAVITY * m])
                    for m, p in zip(weights[k:], points[k:-1], strict=True)
                )
                across = np.einsum("nji,nj->ni", arms[k], moment)[:, :2]
                step[:, k] = across / self.tilt[k] - bend[:, k]
            bend = bend + step
            if np.abs(step).max() < 1e-12:
                return points[-1]
        raise AssertionError("the springs do not settle")

    def _points(
        self, q: np.ndarray, bend: np.ndarray
    ) -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
        """Axes and places of column and elbow, and points: centres of mass of arm, forearm, spindle, payload, and the reflector."""
        a = q + self.zero
        rise = a[:, 2] - self.lead * a[:, 3]
        upper, fore, drop = np.array([UPPER, FORE, -DROP]) + self.lengths
        at0 = np.tile([0.0, 0.0, HEIGHT], (len(q), 1))
        column = turn(1, bend[:, 0, 1]) @ turn(0, bend[:, 0, 0])
        first = column @ turn(2, a[:, 0])
        at1 = at0 + first @ np.array([upper, 0, 0.04])
        before = first @ turn(0, self.lean[0, 0]) @ turn(1, self.lean[0, 1])
        second = before @ turn(1, bend[:, 1, 1]) @ turn(0, bend[:, 1, 0]) @ turn(2, a[:, 1])
        quill = second @ turn(0, self.lean[1, 0]) @ turn(1, self.lean[1, 1])
        at2 = at1 + second @ np.array([fore, 0, drop]) + rise[:, None] * quill[:, :, 2]
        hand = quill @ turn(0, self.lean[2, 0]) @ turn(1, self.lean[2, 1]) @ turn(2, a[:, 3])
        return (
            [np.broadcast_to(np.eye(3), first.shape), before],
            [at0, at1],
            [
                at0 + first @ np.array([0.17, 0, 0.02]),
                at1 + second @ np.array([0.16, 0, 0.06]),
                at2 + quill @ np.array([0, 0, 0.1]),
                at2 + hand @ np.array([0.02, 0, -0.06]),
                at2 + hand @ REFLECTOR,
            ],
        )

    def measured(self, q: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """What a tracker in the hall reads (N, 3), m."""
        stand = (turn(2, 0.8) @ turn(0, -0.02))[0]
        noise = TRACKER * rng.normal(size=(len(q), 3))
        return (self.reflector(q) + noise) @ stand.T + [1.9, -0.7, 0.3]


def poses(count: int, rng: np.random.Generator) -> np.ndarray:
    """Motor positions (N, 4) within the limits."""
    low, high = 0.95 * LIMITS.T
    return rng.uniform(low, high, (count, 4))


def write_robot(folder: Path, more: str = "") -> Path:
    """robot.yaml of the SCARA."""
    folder.mkdir(parents=True, exist_ok=True)
    names, coms = (
        ("upper_arm", "forearm", "quill", "hand"),
        ("0.17 0 0.02", "0.16 0 0.06", "0 0 0.1", "0 0 0"),
    )
    links = ['<link name="base"/>']
    for name, mass, com in zip(names, (*MASSES, 1e-3), coms, strict=True):
        inertia = " ".join(
            f'{k}="{1e-4 if k[1] == k[2] else 0}"' for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        links.append(
            f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/><inertia {inertia}/></inertial></link>'
        )
    places = (f"0 0 {HEIGHT}", f"{UPPER} 0 0.04", f"{FORE} 0 {-DROP}", "0 0 0")
    parents = ("base", "upper_arm", "forearm", "quill")
    joints = [
        f'<joint name="j{k + 1}" type="{"prismatic" if k == 2 else "revolute"}"><parent link="{parents[k]}"/><child link="{names[k]}"/>'
        f'<origin xyz="{places[k]}"/><axis xyz="0 0 1"/><limit lower="{LIMITS[k, 0]}" upper="{LIMITS[k, 1]}" effort="300" '
        'velocity="4"/></joint>'
        for k in range(4)
    ]
    (folder / "scara.urdf").write_text(f'<robot name="scara">{"".join([*links, *joints])}</robot>')
    (folder / "robot.yaml").write_text(
        "robot: scara.urdf\n"
        f"points: {{smr: {{frame: hand, xyz: {REFLECTOR.tolist()}}}}}\n"
        f"payload: {{frame: hand, mass: {PAYLOAD}, com: [0.02, 0.0, -0.06], mass_std: 0.05}}\n"
        f"relations:\n  - {{joint: j3, of: {{j3: 1.0, j4: {-LEAD!r}}}}}\n" + more
    )
    return folder / "robot.yaml"
