"""Two elastic joints with vertical axes and their frequency responses in closed form (two motors, two links, two springs), in numpy alone.

All robots of the type are heavier than their CAD by one factor, and share springs and friction; each has its own beside that.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal import FrequencyResponse

LENGTH, MASSES, CENTRES, MOMENTS = 0.35, (9.0, 5.0), (0.16, 0.14), (0.12, 0.06)
ROTORS = (0.9, 0.35)
STIFFNESS, DAMPING, VISCOUS = (9000.0, 4000.0), (8.0, 4.0), (6.0, 3.0)
LINES = np.arange(2.0, 62.0, 5.0)
URDF = """<robot name="scara"><link name="base"/>
<link name="inner"><inertial><origin xyz="0.16 0 0"/><mass value="9"/>
<inertia ixx="0.02" iyy="0.12" izz="0.12" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="outer"><inertial><origin xyz="0.14 0 0"/><mass value="5"/>
<inertia ixx="0.01" iyy="0.06" izz="0.06" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="inner"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="300" velocity="9"/></joint>
<joint name="j2" type="revolute"><parent link="inner"/><child link="outer"/><origin xyz="0.35 0 0"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="300" velocity="9"/></joint></robot>"""
ROBOT = """robot: scara.urdf
drives: {rotor_inertia: [0.9, 0.35], viscous: [6.0, 3.0], coulomb: [3.0, 1.5]}
elastic:
  - {joint: j1, drive: {stiffness: 14000.0, damping: 8.0}}
  - {joint: j2, drive: {stiffness: 6000.0, damping: 4.0}}
prior: {mass: 0.05, com: 0.002, rotor_inertia: 0.03, torque_constant: 0.005}
"""


@dataclass(frozen=True)
class Scara:
    """A robot: its stiffnesses, N m/rad, and how much heavier than CAD it is."""

    stiffness: tuple[float, float]
    heavier: float

    def response(self, elbow: float, omega: np.ndarray) -> np.ndarray:
        """Motor accelerations over motor torques (L, 2, 2), 1/(kg m²), at the angle of the second joint."""
        (m1, m2), (c1, c2) = np.array(MASSES) * self.heavier, CENTRES
        i1, i2 = np.array(MOMENTS) * self.heavier
        far, cross = i2 + m2 * c2**2, m2 * LENGTH * c2 * np.cos(elbow)
        links = np.array(
            [[i1 + m1 * c1**2 + m2 * LENGTH**2 + far + 2 * cross, far + cross], [far + cross, far]]
        )
        mass = np.block([[np.diag(ROTORS), np.zeros((2, 2))], [np.zeros((2, 2)), links]])
        spring, damper = np.diag(self.stiffness), np.diag(DAMPING)
        stiff = np.block([[spring, -spring], [-spring, spring]])
        damp = np.block([[damper + np.diag(VISCOUS), -damper], [-damper, damper]])
        motors = np.eye(4)[:, :2]
        return np.array(
            [-(w**2) * np.linalg.solve(stiff + 1j * w * damp - w**2 * mass, motors)[:2] for w in omega]
        )

    def measured(self, rng: np.random.Generator, noise: float = 0.02) -> list[FrequencyResponse]:
        """Responses in two poses, with relative noise."""
        found = []
        for pose, elbow in enumerate((0.3, 1.8)):
            exact = self.response(elbow, 2 * np.pi * LINES)
            drawn = (
                noise
                / np.sqrt(2)
                * (rng.standard_normal((4, *exact.shape)) + 1j * rng.standard_normal((4, *exact.shape)))
            )
            each = exact * (1 + drawn)
            size = np.abs(exact).transpose(0, 2, 1).reshape(len(LINES), 4)
            covariance = np.zeros((len(LINES), 4, 4), complex)
            covariance[:, range(4), range(4)] = (noise * size) ** 2 / 4
            found.append(
                FrequencyResponse(
                    LINES, each.mean(axis=0), covariance, covariance.copy(), 200.0, each, ("j1", "j2"), np.array([0.0, elbow]),
                    0.0, pose, 1e-3,
                )
            )  # fmt: skip
        return found


def scara(
    rng: np.random.Generator, spread: float = 0.06, heavier: float = 1.04, softer: float = 1.0
) -> Scara:
    """A robot of the type, whose stiffnesses differ by `spread`; `softer` is the factor of another type."""
    one, two = np.array(STIFFNESS) * softer * np.exp(spread * rng.standard_normal(2))
    return Scara((float(one), float(two)), heavier)


def write_scara(folder: Path) -> Path:
    """Write URDF and robot.yaml."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scara.urdf").write_text(URDF)
    file = folder / "robot.yaml"
    file.write_text(ROBOT)
    return file
