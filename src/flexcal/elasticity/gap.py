"""Backlash in a frequency experiment: how much softer a gap makes a drive, from the torque that its spring carries."""

from __future__ import annotations

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.elasticity.reference_motion import ReferenceMotion
from flexcal.model import RobotModel
from flexcal.model.closed_loop import multisine_torque
from flexcal.model.elastic_arm import ElasticArm
from flexcal.model.linearisation import linearise

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
    axes = arm.joint_velocity[[joint.index for joint in robot.driven]]
    motion = ReferenceMotion.of(plan)
    states = motion.states(robot, arm, q, PHASES)
    slow = np.array(
        [pin.rnea(arm.model, arm.data, s.configuration, s.velocity, s.acceleration)[axes] for s in states]
    )
    system = linearise(robot, q, payload)
    size = multisine_torque(robot, system, plan.frequencies_hz, motion.excitation, motion.kp, motion.kd)
    stiffness = np.array([joint.stiffness[2] for joint in robot.driven])
    return 2 * stiffness * np.exp(-0.5 * (slow / size) ** 2) / (np.sqrt(2 * np.pi) * size)
