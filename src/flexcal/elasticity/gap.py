"""How long the backlash of a drive stands open in a frequency experiment, from the torque that its spring carries."""

from __future__ import annotations

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.elasticity.reference_motion import ReferenceMotion
from flexcal.frequency import FrequencyResponse
from flexcal.model import RobotModel, static_equilibrium
from flexcal.model.elastic_arm import ElasticArm
from flexcal.model.equilibrium import elastic_axes
from flexcal.model.linearisation import linearise


def open_share(
    robot: RobotModel, response: FrequencyResponse, plan: MultisinePlan, half_gap: np.ndarray | float
) -> np.ndarray:
    """Share of time (E,) for which gaps of ± `half_gap` (rad, (E,) or one for all) in each elastic drive is open under a plan in one pose.

    The torque of a drive is gravity's and the reference motion's, plus the multisine's, close to Gaussian: a gap b in series with a
    spring k is open while the torque passes zero, 2 b k times the density of the torque there. By this share an open gap lowers the
    apparent stiffness (Gaussian equivalent gain of a dead band), to first order in the gap.
    """
    slow = _slow_torque(robot, response, ReferenceMotion.of(plan))
    size = multisine_torque(robot, response, plan)
    density = np.exp(-0.5 * (slow / size) ** 2) / (np.sqrt(2 * np.pi) * size)
    stiffness = np.array([joint.stiffness[2] for joint in robot.elastic])
    return np.minimum(2 * half_gap * stiffness * density.mean(axis=0), 0.5)


def multisine_torque(robot: RobotModel, response: FrequencyResponse, plan: MultisinePlan) -> np.ndarray:
    """Standard deviation (E,) N m of the torque in each elastic drive's spring under the multisine, position loop closed."""
    system = linearise(robot, response.q_mean, response.payload)
    count, size = system.inputs, len(system.mass)
    s = 2j * np.pi * plan.frequencies_hz[:, None, None]
    axes = list(plan.joints)
    loop = np.zeros((len(s), size, size), dtype=complex)
    loop[:, range(count), range(count)] = plan.kp[axes] + s[:, :, 0] * plan.kd[axes]
    loop += s**2 * system.mass + s * system.damping + system.stiffness
    moved = np.linalg.solve(loop, np.broadcast_to(np.eye(size, count), (len(s), size, count)))
    twist = [count + k for k, (_, component) in enumerate(elastic_axes(robot)) if component == 2]
    stiffness = np.array([joint.stiffness[2] for joint in robot.elastic])
    torque = stiffness[:, None] * (moved[:, twist] - moved[:, :count])
    power = np.abs(torque) ** 2 * (plan.amplitude.T[:, None, :] ** 2 / count)
    return np.sqrt(0.5 * power.sum(axis=(0, 2)))


def _slow_torque(
    robot: RobotModel, response: FrequencyResponse, motion: ReferenceMotion, phases: int = 64
) -> np.ndarray:
    """Torque (phases, E) N m in each elastic drive's spring along the reference motion."""
    import pinocchio as pin

    arm = ElasticArm(robot, response.payload)
    rest = static_equilibrium(robot, response.q_mean, arm.payload)
    still = arm.configuration(response.q_mean, rest.deflection[0])
    axes = arm.joint_velocity[[joint.index for joint in robot.elastic]]
    omega = 2 * np.pi * motion.frequency_hz
    result = []
    for angle in 2 * np.pi * np.arange(phases) / phases:
        at, velocity, acceleration = still.copy(), np.zeros(arm.model.nv), np.zeros(arm.model.nv)
        at[axes] += motion.amplitude * np.sin(angle)
        velocity[axes] = motion.amplitude * omega * np.cos(angle)
        acceleration[axes] = -motion.amplitude * omega**2 * np.sin(angle)
        result.append(pin.rnea(arm.model, arm.data, at, velocity, acceleration)[axes])
    return np.array(result)
