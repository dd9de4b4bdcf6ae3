"""Backlash in a frequency experiment: how much softer a gap makes a drive, from the torque that its spring carries."""

from __future__ import annotations

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.elasticity.reference_motion import ReferenceMotion
from flexcal.elasticity.sidebands import Sidebands
from flexcal.model import RobotModel
from flexcal.model.elastic_arm import ElasticArm
from flexcal.model.equilibrium import elastic_axes
from flexcal.model.linearisation import Linearisation, linearise

PHASES = 64
"""Instants of the reference motion at which gaps are looked at."""


def gap_compliance(
    robot: RobotModel, q: np.ndarray, payload: float | None, plan: MultisinePlan
) -> np.ndarray:
    """What a gap adds to the compliance of each elastic drive along the reference motion, relative, per rad of half gap, (phases, E).

    `q` (n,) rad is the mean motor position, `payload` in kg. The torque of a drive is gravity's and the reference motion's, plus the
    multisine's, close to Gaussian. A gap ± b twists by b sgn(torque), whose equivalent gain for a Gaussian torque is 2 b times the
    density of the torque at zero (Bussgang 1952), in series with the spring's 1/k.
    """
    import pinocchio as pin

    arm = ElasticArm(robot, payload)
    axes = arm.joint_velocity[[joint.index for joint in robot.elastic]]
    states = ReferenceMotion.of(plan).states(robot, arm, q, PHASES)
    slow = np.array(
        [pin.rnea(arm.model, arm.data, s.configuration, s.velocity, s.acceleration)[axes] for s in states]
    )
    size = multisine_torque(robot, q, payload, plan)
    stiffness = np.array([joint.stiffness[2] for joint in robot.elastic])
    return 2 * stiffness * np.exp(-0.5 * (slow / size) ** 2) / (np.sqrt(2 * np.pi) * size)


def multisine_torque(
    robot: RobotModel, q: np.ndarray, payload: float | None, plan: MultisinePlan
) -> np.ndarray:
    """Standard deviation (E,) N m of the torque in each elastic drive's spring under the multisine, position loop closed."""
    system, motion = linearise(robot, q, payload), ReferenceMotion.of(plan)
    bands = Sidebands.of(system, plan.frequencies_hz, motion, np.array([0]))
    pull = drive_pull(robot, system)
    moved = bands.response(np.eye(len(system.mass), system.inputs))[:, 0]
    stiffness = np.array([joint.stiffness[2] for joint in robot.elastic])
    power = np.abs(stiffness[:, None] * (pull.T @ moved)) ** 2 * motion.excitation.T[:, None, :] ** 2
    return np.sqrt(0.5 * power.sum(axis=(0, 2)))


def drive_pull(robot: RobotModel, system: Linearisation) -> np.ndarray:
    """Direction (d, E) in which each drive's spring is stretched: its twist less its motor."""
    twists = [k for k, (_, component) in enumerate(elastic_axes(robot)) if component == 2]
    pull = np.zeros((len(system.mass), system.inputs))
    pull[range(system.inputs), range(system.inputs)] = -1.0
    pull[system.inputs + np.array(twists), range(system.inputs)] = 1.0
    return pull
