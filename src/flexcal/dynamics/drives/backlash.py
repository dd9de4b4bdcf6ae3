"""Estimation of the gaps of elastic drives with backlash, in preceding passes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import ExperimentSystem, RegressionData

_PASSES = 2
"""Number of passes: the first estimates the encoder difference of the relaxed spring, the second the gap width there."""


def with_backlash(
    observation: Observation, equations: Callable[[Observation], Sequence[ExperimentSystem]]
) -> Observation:
    """Observation with estimated gaps of the springs at joints with backlash; unchanged without such springs.

    `equations` gives those of the fit for any observation. Raises `FlexcalError` as `weighted_least_squares` does.
    """
    model = observation.model
    if not any(spring.joint in model.backlash_joints for spring in observation.springs):
        return observation
    for _ in range(_PASSES):
        data = RegressionData.of(observation, BaseParameters.of(observation), equations(observation))
        values = weighted_least_squares(data).values
        springs = (
            spring.with_backlash(model, values) if spring.joint in model.backlash_joints else spring
            for spring in observation.springs
        )
        observation = replace(observation, springs=tuple(springs))
    return observation
