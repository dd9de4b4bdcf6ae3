"""Effects of the experiment on a frequency response: reference motion, gaps opened by it, friction at its reversals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.elasticity.response_model.prediction import PoseModel, ResponseModel
from flexcal.elasticity.time_periodic import FrictionPulses, ReferenceMotion, reference_shift
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.vibration import linearise


@dataclass(frozen=True, eq=False)
class ExperimentEffect:
    """Change `shift` (L, E + S, E) of the response from that of the robot at rest; `by_friction` (L, E + S, E, 2 E) is its derivative by
    the logarithm of the strength, then of the width, of the friction pulses of every motor.
    """

    shift: np.ndarray
    by_friction: np.ndarray

    @classmethod
    def none(cls, response: FrequencyResponse) -> ExperimentEffect:
        """Zero effect, of a robot at rest."""
        shape = response.stacked.shape
        return cls(np.zeros(shape, complex), np.zeros((*shape, 0), complex))


def experiment_effects(
    model: ResponseModel, x: np.ndarray, reference: ReferenceMotion
) -> list[ExperimentEffect]:
    """Effects of every pose at the coordinates x (p,).

    What a motor's viscous coefficient in a pose exceeds that of robot.yaml by is taken for friction, where robot.yaml gives the joint
    a Coulomb friction.
    """
    natural = model.parameters.natural(x)
    return [_effect(model, pose, natural, reference) for pose in model.poses]


def _effect(
    model: ResponseModel, pose: PoseModel, natural: np.ndarray, reference: ReferenceMotion
) -> ExperimentEffect:
    known, payload = pose.values(model.robot, natural)
    robot = model.robot.with_values(known)
    axes = [joint.index for joint in robot.driven]
    excess = np.maximum(robot.drives.viscous - np.nan_to_num(model.robot.drives.viscous), 0.0)
    strength = np.where(model.robot.drives.coulomb > 0, excess, 0.0)[axes]
    sensors = pose.placed(natural)
    system = linearise(robot, pose.q, payload, sensors=sensors)
    pulses = FrictionPulses.of(system, pose.frequencies_hz, reference, strength)
    opening = pose.opening(model.robot, natural)
    moving = reference_shift(robot, pose.q, payload, pose.frequencies_hz, reference, opening, sensors)
    factor = pose.measured(natural)
    return ExperimentEffect((moving + pulses.shift) * factor, pulses.shift_by_form() * factor[..., None])
