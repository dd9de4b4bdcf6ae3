"""Two-stage calibration read from the folder of `flexcal demo`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.verification import ArmPoses, MeasuredPoints, PredictionErrors
from flexcal.data.plans import MultisinePlan
from flexcal.estimation import Estimate
from flexcal.files.formats import Block
from flexcal.report.results.fitted_response import FittedResponse
from flexcal.report.results.identifiability import IdentifiableParameters
from flexcal.report.results.published_values import PublishedValues


@dataclass(frozen=True)
class RigidFit:
    """A fit without elasticity: to so many `poses`, of so many determined parameters, and its errors at the fresh poses."""

    poses: int
    rank: int
    errors: ErrorStatistics


@dataclass(frozen=True, eq=False)
class TwoStageStudy:
    """One simulated robot, both stages, and how they were checked.

    `results` is the document of results.json, `estimates` the blocks of estimates.yaml; `plan` and `responses` are those of stage 1,
    `points` and `arms` the measured poses of stage 2. `fresh` are poses that no fit saw, as the tracker read them, with the errors of the
    robot as delivered, of the fairest rigid fit and of the calibrated robot; `exact` the same against the noise-free truth.
    """

    results: Mapping[str, Any]
    estimates: Mapping[Block, Estimate]
    plan: MultisinePlan
    responses: tuple[FittedResponse, ...]
    points: MeasuredPoints
    arms: ArmPoses
    fresh: MeasuredPoints
    exact: MeasuredPoints
    paper: PublishedValues | None = None

    @property
    def truth(self) -> Mapping[str, float]:
        """True parameters of the robot: SI values by parameter name."""
        return self.results["truth"]

    @property
    def stiffness(self) -> Estimate:
        """Estimate of stage 1."""
        return self.estimates["stiffness"]

    @property
    def geometry(self) -> Estimate:
        """Estimate of stage 2."""
        return self.estimates["calibration"]

    @property
    def determined(self) -> IdentifiableParameters:
        """Parameters determined by the points of stage 2."""
        return IdentifiableParameters.stored(self.results["identifiability"])

    @property
    def kept(self) -> tuple[str, ...]:
        """Names of the geometric parameters that they determine."""
        return tuple(self.results["identifiability"]["kept"])

    @property
    def verification(self) -> PredictionErrors:
        """The calibrated robot at the fresh poses, as the tracker read them."""
        return self.fresh.verification

    @cached_property
    def rigid(self) -> tuple[RigidFit, ...]:
        """Fits of the same robot without elasticity, the fairest one first."""
        fits = self.results["rigid_fits"]
        return tuple(
            RigidFit(f["poses"], f["rank"], self.errors(f"measured_rigid_{f['poses']}")) for f in fits
        )

    def errors(self, model: str) -> ErrorStatistics:
        """At the fresh poses, of one of the models of results.json."""
        return ErrorStatistics.of_millimetres(self.results["verification"][model])

    def springs(self, kind: Literal["stiffness", "damping"]) -> tuple[str, ...]:
        """Names of all stiffnesses or all dampings of drives and bearings."""
        return tuple(name for name in self.stiffness.parameters.names if name.endswith(f".{kind}"))

    @property
    def floor(self) -> ErrorStatistics | None:
        """Error at the fresh poses with every parameter known; None for a robot with other parameters than the model."""
        return None if self.results["verification"]["floor"] is None else self.errors("floor")
