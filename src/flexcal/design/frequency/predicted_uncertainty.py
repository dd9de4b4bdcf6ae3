"""Predicted standard deviations from the frequency responses of a plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.design.frequency.response_jacobian import (
    PoseResponse,
    friction_disturbance,
    pose_response,
    prior_of_parameters,
    response_parameters,
)
from flexcal.design.frequency.response_noise import COMMON_SENSORS, ResponseSensors
from flexcal.design.frequency.spring_precision import largest_stiffness_std, spring_std
from flexcal.errors import FlexcalError
from flexcal.estimation import Parameters, Sensitivity
from flexcal.model.robot import RobotModel

FEWEST, MOST = 3, 24
"""Bounds of the number of realisations: fewer give no covariance, more hardly any gain."""
MOST_PERIODS = 16
"""Largest number of kept periods of a recording."""


@dataclass(frozen=True, eq=False)
class PlannedResponses:
    """The `responses` in the poses of `plan`, and the shared `parameters` with the `prior_information` (p, p) about them."""

    plan: MultisinePlan
    parameters: Parameters
    prior_information: np.ndarray
    responses: tuple[PoseResponse, ...]

    @classmethod
    def of(
        cls, model: RobotModel, plan: MultisinePlan, sensors: ResponseSensors = COMMON_SENSORS
    ) -> PlannedResponses:
        """Planned responses of the present robot model."""
        parameters = response_parameters(model, plan)
        responses = (
            pose_response(model, q, plan, parameters, friction_disturbance(model, q, plan), sensors)
            for q in plan.poses
        )
        return cls(plan, parameters, prior_of_parameters(model, parameters), tuple(responses))

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """Sensitivity of every pose of the plan as a candidate."""
        rows = np.array([response.rows(self.plan) for response in self.responses])
        return Sensitivity(rows, self.parameters, self.prior_information)

    def std(self) -> dict[str, float]:
        """Predicted relative standard deviation of every stiffness and damping."""
        return spring_std(self.sensitivity)

    def reaching(self, desired_std: float) -> PlannedResponses:
        """Plan with the realisations and periods of the shortest experiment with a standard deviation of at most `desired_std` for every
        stiffness.

        Kept periods come in twos, after which the reference motion repeats. Raises `FlexcalError` that says what is reached where the
        distortion that realisations share, or what is not known of the links, leaves more.
        """
        step = self.plan.periods - self.plan.settle_periods
        tried = [
            (realisations * (self.plan.settle_periods + kept), realisations, kept)
            for realisations in range(FEWEST, MOST + 1)
            for kept in range(step, MOST_PERIODS + 1, step)
        ]
        most = self._measured(MOST, MOST_PERIODS // step * step)
        name, reached = largest_stiffness_std(most.sensitivity)
        if reached > desired_std:
            raise FlexcalError(
                "E-DESIGN-010",
                f"a standard deviation of {100 * desired_std:g} % is not reached with any duration: {MOST} realisations leave "
                f"{100 * reached:.2g} % for {name}; choose more poses or hold a payload off the wrist's axis.",
            )
        for _, realisations, kept in sorted(tried):
            planned = self._measured(realisations, kept)
            if largest_stiffness_std(planned.sensitivity)[1] <= desired_std:
                return planned
        return most

    def _measured(self, realisations: int, kept: int) -> PlannedResponses:
        periods = self.plan.settle_periods + kept
        return replace(self, plan=replace(self.plan, realisations=realisations, periods=periods))
