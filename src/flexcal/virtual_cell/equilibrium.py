"""Static equilibrium of the virtual robot with springs, gravity and backlash (Eqs. 10-14), in MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.virtual_cell.plant import Plant, gravity_force, gravity_stiffness, spring_tangent, spring_torque

if TYPE_CHECKING:
    import mujoco

TOLERANCE = 1e-13  # rad, of the last Newton step
ITERATIONS = 30
FLANKS = 8


@dataclass(frozen=True, eq=False)
class StaticEquilibrium:
    """A rest position (d,) of a plant and the torque (m,) N m of each free motor that holds it against gravity."""

    position: np.ndarray
    torque: np.ndarray


def rest(
    plant: Plant, data: mujoco.MjData, motors: np.ndarray, slip: np.ndarray | None = None
) -> StaticEquilibrium:
    """Rest position with the free motors held at `motors` (m,) rad.

    Every gap is taken up on the side of the true spring torque τ of the motor on the arm: q_arm = q_M − b sign τ − τ/c. `slip` (d,)
    in [-1, 1] is the state of each spring's hysteresis (0: none). `data` is left at the solution. Raises `FlexcalError` where
    gravity is too strong for the springs.
    """
    start = np.zeros(plant.mjmodel.nv)
    start[plant.motors] = motors
    load = np.zeros_like(start) if slip is None else plant.springs[:, 4] * slip
    has_backlash = plant.springs[:, 2] > 0
    flank = np.where(has_backlash, np.sign(gravity_force(plant, data, start)), 0.0)
    passes = 0
    while True:
        passes += 1
        position, torque = _balance(plant, data, start, flank, load)
        seen = np.where(has_backlash, np.sign(torque), 0.0)
        if np.array_equal(seen, flank) or passes == FLANKS:
            return StaticEquilibrium(position, torque[plant.motors])
        flank = seen


def _balance(
    plant: Plant, data: mujoco.MjData, start: np.ndarray, flank: np.ndarray, load: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Newton's method on the elastic coordinates; the gravity stiffness is taken at the start."""
    free = plant.elastic
    position = start.copy()
    if len(free) == 0:
        return position, gravity_force(plant, data, position)
    sagging = gravity_stiffness(plant, data, position)[np.ix_(free, free)]
    for _ in range(ITERATIONS):
        torque = gravity_force(plant, data, position)
        residual = (torque + load + spring_torque(plant, position, flank))[free]
        move = -np.linalg.solve(sagging + np.diag(spring_tangent(plant, position)[free]), residual)
        position[free] += move
        if np.abs(move).max() < TOLERANCE:
            return position, gravity_force(plant, data, position)
    raise FlexcalError(
        "E-CELL-023",
        "the virtual robot has no stable equilibrium: its springs are too soft for gravity; check the stiffnesses in robot.yaml and in "
        "cell.yaml or the truth.",
    )
