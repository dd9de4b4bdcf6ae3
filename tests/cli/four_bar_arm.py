"""A four-axis arm whose second motor lifts it through a crank and a rod, with nothing of flexcal in it: circles that intersect.

In the plane of the column, which turns about the vertical: crank A-B by the motor, rod B-C, arm D-C that carries the elbow in front of D.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from palletiser import turn

LIMITS = np.array([[-2.6, 2.6], [-0.75, 0.75], [-1.6, 1.0], [-2.8, 2.8]])
PIVOT, CRANK = np.array([0.15, 0.0, 0.7]), np.array([0.05, 0.0, 0.2])
"""D and A in the column, m."""
CRANK_END, ROD_END, PIN = np.array([-0.18, 0.0, 0.0]), np.array([0.03, 0.0, 0.5]), np.array([-0.2, 0.0, 0.0])
"""B in the crank, C in the rod, C in the arm, all standing at zero, m: there the loop is closed."""
ARM, FOREARM = np.array([0.85, 0.0, 0.0]), np.array([0.6, 0.0, 0.0])
REFLECTOR = np.array([0.14, 0.06, 0.09])
MASSES = np.array([50.0, 12.0, 5.0, 40.0, 25.0, 6.0])
"""kg: column, crank, rod, arm, forearm, hand."""
COMS = np.array([[0, 0, 0.3], [-0.1, 0, 0], [0.01, 0, 0.25], [0.4, 0, 0.02], [0.3, 0, 0], [0.08, 0, 0]])
DRIVES = np.array([400e3, 90e3, 120e3, 40e3])
GRAVITY = 9.81


@dataclass(frozen=True)
class FourBarArm:
    """One as built: zeros of the motors (rad), places of its points (m), axes that lean (rad), stiffness (N m/rad)."""

    zero: np.ndarray
    pivot: np.ndarray
    crank: np.ndarray
    crank_end: np.ndarray
    rod: float
    pin: np.ndarray
    arm: np.ndarray
    forearm: np.ndarray
    lean: np.ndarray
    drives: np.ndarray

    @classmethod
    def nominal(cls) -> FourBarArm:
        """As drawn, and stiff."""
        rod = float(np.linalg.norm(ROD_END))
        stiff = np.full(4, np.inf)
        return cls(np.zeros(4), PIVOT, CRANK, CRANK_END, rod, PIN, ARM, FOREARM, np.zeros(3), stiff)

    @classmethod
    def drawn(cls, seed: int, spread: float = 0.07) -> FourBarArm:
        """As built: a millimetre and two milliradians off."""
        rng = np.random.default_rng(seed)

        def off(at: np.ndarray, *, level: bool = False) -> np.ndarray:
            return at + 1e-3 * rng.normal(size=3) * ([1, 0, 1] if level else 1)

        return cls(
            2e-3 * rng.normal(size=4),
            PIVOT,
            off(CRANK, level=True),
            off(CRANK_END, level=True),
            float(np.linalg.norm(ROD_END)) + 1e-3 * float(rng.normal()),
            off(PIN, level=True),
            off(ARM),
            off(FOREARM),
            8e-4 * rng.normal(size=3),
            DRIVES * np.exp(spread * rng.normal(size=4)),
        )

    def arm_angle(self, crank: np.ndarray) -> np.ndarray:
        """Angle (N,) of the arm about y for the crank's, from where the circles about B and D meet, behind and above; NaN where none."""
        b = self.crank + (turn(1, crank) @ self.crank_end)
        to_pivot = self.pivot - b
        distance = np.hypot(to_pivot[:, 0], to_pivot[:, 2])
        radius = np.hypot(self.pin[0], self.pin[2])
        along = (distance**2 + self.rod**2 - radius**2) / (2 * distance)
        with np.errstate(invalid="ignore"):
            across = np.sqrt(self.rod**2 - along**2)
        unit = to_pivot / distance[:, None]
        side = np.stack([-unit[:, 2], np.zeros(len(unit)), unit[:, 0]], axis=1)
        meeting = b + along[:, None] * unit + across[:, None] * side
        beyond = meeting - self.pivot
        # a rotation by φ about y takes (x, z) to (x cos φ + z sin φ, z cos φ - x sin φ)
        return np.arctan2(-beyond[:, 2], beyond[:, 0]) - np.arctan2(-self.pin[2], self.pin[0])

    def reflector(self, q: np.ndarray) -> np.ndarray:
        """Where the reflector is (N, 3), m, in the base frame with the motors at `q` (N, 4), deflected by gravity."""
        bend = np.zeros_like(q)
        for _ in range(80):
            step = self._torque(q, bend) / self.drives - bend
            bend = bend + step
            if np.abs(step).max() < 1e-11:
                return self._points(q + self.zero + bend)[-1]
        raise AssertionError("the springs do not settle")

    def _points(self, angle: np.ndarray) -> list[np.ndarray]:
        """Centres of mass of the six links, and the reflector."""
        column = turn(2, angle[:, 0])
        raised = self.arm_angle(angle[:, 1])
        crank = column @ turn(1, angle[:, 1])
        at_b = column @ self.crank + crank @ self.crank_end
        arm = column @ turn(0, self.lean[0]) @ turn(1, raised)
        at_d = column @ self.pivot
        flat = self.pivot + turn(1, raised) @ self.pin - (self.crank + turn(1, angle[:, 1]) @ self.crank_end)
        tilt = np.arctan2(flat[:, 0], flat[:, 2]) - np.arctan2(ROD_END[0], ROD_END[2])
        rod = column @ turn(1, tilt)
        elbow = at_d + arm @ self.arm
        fore = arm @ turn(2, self.lean[1]) @ turn(1, angle[:, 2])
        wrist = elbow + fore @ self.forearm
        hand = fore @ turn(2, self.lean[2]) @ turn(0, angle[:, 3])
        return [
            column @ COMS[0],
            column @ self.crank + crank @ COMS[1],
            at_b + rod @ COMS[2],
            at_d + arm @ COMS[3],
            elbow + fore @ COMS[4],
            wrist + hand @ COMS[5],
            wrist + hand @ REFLECTOR,
        ]

    def _torque(self, q: np.ndarray, bend: np.ndarray) -> np.ndarray:
        def energy(bend: np.ndarray) -> np.ndarray:
            points = self._points(q + self.zero + bend)
            return GRAVITY * np.sum([m * p[:, 2] for m, p in zip(MASSES, points[:-1], strict=True)], axis=0)

        step = 1e-4
        return np.stack(
            [-(energy(bend + e) - energy(bend - e)) / (2 * step) for e in step * np.eye(4)], axis=1
        )

    def measured(self, q: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """What a tracker in the hall reads (N, 3), m."""
        stand = (turn(2, -2.1) @ turn(1, 0.02))[0]
        noise = 0.02e-3 * rng.normal(size=(len(q), 3))
        return (self.reflector(q) + noise) @ stand.T + [2.4, -0.3, 0.8]


def poses(count: int, rng: np.random.Generator) -> np.ndarray:
    """Motor positions (N, 4) within the limits."""
    return rng.uniform(0.95 * LIMITS[:, 0], 0.95 * LIMITS[:, 1], (count, 4))


def write_robot(folder: Path, *, elastic: bool = True, rod: np.ndarray = ROD_END) -> Path:
    """robot.yaml of the arm as drawn; its rod may be drawn too short."""
    folder.mkdir(parents=True, exist_ok=True)
    names = ("column", "crank", "rod", "arm", "forearm", "hand")
    parts = ['<link name="base"/>', '<link name="rod_end"/>', '<link name="arm_pin"/>']
    for name, mass, com in zip(names, MASSES, COMS, strict=True):
        xyz = " ".join(map(str, com))
        parts.append(
            f'<link name="{name}"><inertial><origin xyz="{xyz}"/><mass value="{mass}"/>'
            '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>'
        )

    def joint(name: str, parent: str, child: str, at: np.ndarray, axis: str, limits: np.ndarray) -> str:
        xyz = " ".join(map(str, at))
        return (
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
            f'<axis xyz="{axis}"/><limit lower="{limits[0]}" upper="{limits[1]}" effort="2000" velocity="2"/></joint>'
        )

    def fixed(name: str, parent: str, at: np.ndarray) -> str:
        xyz = " ".join(map(str, at))
        return f'<joint name="{name}_mount" type="fixed"><parent link="{parent}"/><child link="{name}"/><origin xyz="{xyz}"/></joint>'

    wide = np.array([-2.5, 2.5])
    parts += [
        joint("joint_1", "base", "column", np.zeros(3), "0 0 1", LIMITS[0]),
        joint("joint_2", "column", "crank", CRANK, "0 1 0", LIMITS[1]),
        joint("rod_joint", "crank", "rod", CRANK_END, "0 1 0", wide),
        fixed("rod_end", "rod", rod),
        joint("arm_joint", "column", "arm", PIVOT, "0 1 0", wide),
        fixed("arm_pin", "arm", PIN),
        joint("joint_3", "arm", "forearm", ARM, "0 1 0", LIMITS[2]),
        joint("joint_4", "forearm", "hand", FOREARM, "1 0 0", LIMITS[3]),
    ]
    (folder / "arm.urdf").write_text(f'<robot name="four_bar_arm">{"".join(parts)}</robot>')
    springs = "".join(
        f"  - {{joint: joint_{k + 1}, drive: {{stiffness: {stiffness}}}}}\n"
        for k, stiffness in enumerate(DRIVES)
    )
    (folder / "robot.yaml").write_text(
        "robot: arm.urdf\n"
        f"points: {{smr: {{frame: hand, xyz: {REFLECTOR.tolist()}}}}}\n"
        + (f"elastic:\n{springs}" if elastic else "")
        + "motors: [joint_1, joint_2, joint_3, joint_4]\n"
        + "loops:\n  four_bar: {a: rod_end, b: arm_pin, passive: {rod_joint: 0.1, arm_joint: -0.1}}\n"
    )
    return folder / "robot.yaml"
