"""A four-axis palletiser whose parallelograms keep its wrist level, and a tracker, with nothing of flexcal in them.

Motor 2 leans the lower arm, motor 3 turns a lever about the same axis, whose rod turns the upper arm in the world, and a second pair of
rods keeps the wrist level, so the positions of elbow and wrist are q3 - q2 and -q3, of the arms as they really stand, deflected by
gravity. The upper arm's weight goes through the rod onto the lever: motor 3 carries it, motor 2 the weight at the elbow.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

LIMITS = np.array([[-2.8, 2.8], [-0.7, 1.2], [-0.4, 1.1], [-3.0, 3.0]])
BASE, SHOULDER, UPPER, FORE, WRIST, FLANGE = 0.45, 0.3, 0.9, 1.1, 0.22, 0.12
MASSES = np.array([120.0, 60.0, 45.0, 18.0, 4.0])
"""kg: column, lower arm, upper arm, wrist, flange."""
PAYLOAD = 40.0
REFLECTOR = np.array([0.11, 0.04, -0.09])
DRIVES = np.array([500e3, 400e3, 260e3, 60e3])
GRAVITY = 9.81
TRACKER = 0.02e-3


def turn(axis: int, angle: np.ndarray | float) -> np.ndarray:
    """Rotation matrices (N, 3, 3) about a coordinate axis."""
    angle = np.atleast_1d(np.asarray(angle, dtype=float))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    result = np.zeros((len(angle), 3, 3))
    result[:, axis, axis] = 1
    result[:, i, i] = result[:, j, j] = np.cos(angle)
    result[:, j, i], result[:, i, j] = np.sin(angle), -np.sin(angle)
    return result


@dataclass(frozen=True)
class Palletiser:
    """One as built: zeros of its four motors and of elbow and wrist (rad), lengths (m), axes that lean (rad), stiffness (N m/rad)."""

    zero: np.ndarray
    levels: np.ndarray
    lengths: np.ndarray
    lean: np.ndarray
    drives: np.ndarray

    @classmethod
    def nominal(cls) -> Palletiser:
        """As drawn, and stiff."""
        return cls(np.zeros(4), np.zeros(2), np.zeros(5), np.zeros(4), np.full(4, np.inf))

    @classmethod
    def drawn(cls, seed: int, spread: float = 0.07) -> Palletiser:
        """As built."""
        rng = np.random.default_rng(seed)
        return cls(
            2e-3 * rng.normal(size=4),
            1.5e-3 * rng.normal(size=2),
            8e-4 * rng.normal(size=5),
            8e-4 * rng.normal(size=4),
            DRIVES * np.exp(spread * rng.normal(size=4)),
        )

    def reflector(self, q: np.ndarray, payload: np.ndarray | float = PAYLOAD) -> np.ndarray:
        """Where the reflector is (N, 3), m, in the base frame with the motors at `q` (N, 4), deflected by gravity."""
        bend = np.zeros_like(q)
        for _ in range(60):
            step = self._torque(q, bend, payload) / self.drives - bend
            bend = bend + step
            if np.abs(step).max() < 1e-11:
                return self._points(q, bend)[-1]
        raise AssertionError("the springs do not settle")

    def _points(self, q: np.ndarray, bend: np.ndarray) -> list[np.ndarray]:
        """Centres of mass of column, lower arm, upper arm, wrist, flange, the payload's, and the reflector."""
        angle = q + self.zero + bend
        elbow = angle[:, 2] - angle[:, 1] + self.levels[0]
        wrist = -angle[:, 2] + self.levels[1]
        a, b, c, d, e = np.array([SHOULDER, UPPER, FORE, WRIST, FLANGE]) + self.lengths
        lean = self.lean
        column = turn(2, angle[:, 0])
        at0 = np.array([0.0, 0.0, BASE])
        at1 = at0 + column @ np.array([a, 0, 0])
        lower = column @ turn(2, lean[0]) @ turn(1, angle[:, 1])
        at2 = at1 + lower @ np.array([0, 0, b])
        upper = lower @ turn(0, lean[1]) @ turn(1, elbow)
        at3 = at2 + upper @ np.array([c, 0, 0])
        level = upper @ turn(2, lean[2]) @ turn(1, wrist)
        at4 = at3 + level @ np.array([d, 0, 0])
        hand = level @ turn(0, lean[3]) @ turn(2, angle[:, 3])
        return [
            at0 + column @ np.array([0.1, 0, 0.0]),
            at1 + lower @ np.array([0.02, 0, 0.4]),
            at2 + upper @ np.array([0.45, 0, 0.05]),
            at3 + level @ np.array([0.1, 0, 0]),
            at4 + hand @ np.array([0, 0, -0.05]),
            at4 + hand @ np.array([0.08, 0.0, -e - 0.2]),
            at4 + hand @ (REFLECTOR - np.array([0, 0, e])),
        ]

    def _torque(self, q: np.ndarray, bend: np.ndarray, payload: np.ndarray | float) -> np.ndarray:
        """What the weights do on the motors (N, 4), N m: minus the slope of their height by central differences."""

        def energy(bend: np.ndarray) -> np.ndarray:
            points = self._points(q, bend)
            weights = [*MASSES, payload]
            return GRAVITY * np.sum([m * p[:, 2] for m, p in zip(weights, points[:-1], strict=True)], axis=0)

        step = 1e-4
        return np.stack(
            [-(energy(bend + e) - energy(bend - e)) / (2 * step) for e in step * np.eye(4)], axis=1
        )

    def measured(
        self, q: np.ndarray, rng: np.random.Generator, payload: np.ndarray | float = PAYLOAD
    ) -> np.ndarray:
        """What a tracker in the hall reads (N, 3), m."""
        stand = (turn(2, 1.9) @ turn(0, 0.03))[0]
        noise = TRACKER * rng.normal(size=(len(q), 3))
        return (self.reflector(q, payload) + noise) @ stand.T + [4.1, 0.6, 0.9]


def poses(count: int, rng: np.random.Generator) -> np.ndarray:
    """Motor positions (N, 4) within the limits."""
    low, high = 0.95 * LIMITS.T
    return rng.uniform(low, high, (count, 4))


def write_robot(folder: Path, *, mimic: bool, elastic: bool = True) -> Path:
    """robot.yaml of the palletiser; its relations stand in the URDF, as far as <mimic> can say them, or in robot.yaml."""
    folder.mkdir(parents=True, exist_ok=True)
    names = ("column", "lower_arm", "upper_arm", "wrist", "flange", "lever")
    coms = ((0.1, 0, 0), (0.02, 0, 0.4), (0.45, 0, 0.05), (0.1, 0, 0), (0, 0, -0.05 + FLANGE), (0, 0, 0))
    links = ['<link name="base"/>']
    for name, mass, com in zip(names, (*MASSES, 1e-9), coms, strict=True):
        inertia = " ".join(
            f'{k}="{1e-9 if k[1] == k[2] else 0}"' for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        xyz = " ".join(map(str, com))
        links.append(
            f'<link name="{name}"><inertial><origin xyz="{xyz}"/><mass value="{mass}"/><inertia {inertia}/></inertial></link>'
        )

    def joint(
        name: str, parent: str, child: str, xyz: str, axis: str, limits: np.ndarray, extra: str = ""
    ) -> str:
        return (
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
            f'<axis xyz="{axis}"/><limit lower="{limits[0]}" upper="{limits[1]}" effort="3000" velocity="2"/>{extra}</joint>'
        )

    level = '<mimic joint="joint_3" multiplier="-1"/>' if mimic else ""
    wide = np.array([-3.0, 3.0])
    joints = [
        joint("joint_1", "base", "column", f"0 0 {BASE}", "0 0 1", LIMITS[0]),
        joint("joint_2", "column", "lower_arm", f"{SHOULDER} 0 0", "0 1 0", LIMITS[1]),
        joint("elbow", "lower_arm", "upper_arm", f"0 0 {UPPER}", "0 1 0", wide),
        joint("level", "upper_arm", "wrist", f"{FORE} 0 0", "0 1 0", wide, level),
        joint("joint_3", "column", "lever", f"{SHOULDER} 0 0", "0 1 0", LIMITS[2]),
        joint("joint_4", "wrist", "flange", f"{WRIST} 0 {-FLANGE}", "0 0 1", LIMITS[3]),
    ]
    (folder / "palletiser.urdf").write_text(f'<robot name="palletiser">{"".join([*links, *joints])}</robot>')
    springs = "".join(
        f"  - {{joint: joint_{k + 1}, drive: {{stiffness: {stiffness}}}}}\n"
        for k, stiffness in enumerate(DRIVES)
    )
    (folder / "robot.yaml").write_text(
        "robot: palletiser.urdf\n"
        f"points: {{smr: {{frame: flange, xyz: {REFLECTOR.tolist()}}}}}\n"
        f"payload: {{frame: flange, mass: {PAYLOAD}, com: [0.08, 0.0, -0.2], mass_std: 0.05}}\n"
        + (f"elastic:\n{springs}" if elastic else "")
        + "motors: [joint_1, joint_2, joint_3, joint_4]\n"
        + "relations:\n  - {joint: elbow, of: {joint_3: 1.0, joint_2: -1.0}}\n"
        + ("" if mimic else "  - {joint: level, of: {joint_3: -1.0}}\n")
    )
    return folder / "robot.yaml"
