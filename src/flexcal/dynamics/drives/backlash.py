"""Position of the gaps of elastic drives with backlash, estimated in preceding passes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import ExperimentSystem, RegressionData

_PASSES = 2
"""The first finds at what reading of both encoders a spring is relaxed, the second how wide the gap there is."""


def with_backlash(
    observation: Observation, equations: Callable[[Observation], Sequence[ExperimentSystem]]
) -> Observation:
    """The observation whose springs at joints with backlash know their gap; the same where no spring has one.

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
