"""Results of a two-stage calibration of the virtual robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.verification import ErrorCovariance, PredictionErrors, UncalibratedErrors
from flexcal.data.plans import MultisinePlan
from flexcal.data.poses import PoseSet
from flexcal.elasticity.identification import SpringFit
from flexcal.estimation import Estimate
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.jobs.two_stage.cells import CellName
from flexcal.model.robot import RobotModel
from flexcal.report.checks import Trust


@dataclass(frozen=True, eq=False)
class CadInertialsRun:
    """Both stages fitted again to the same data with CAD inertials in place of the identified ones."""

    stiffness: SpringFit
    calibration: GeometricFit
    verification: PredictionErrors


@dataclass(frozen=True, eq=False)
class TwoStageRun:
    """Two-stage calibration of one robot, both stages, and their verification.

    `nominal` is the robot of the data sheet; `informed` what both stages start from, with the inertials `dynamics` that trajectories
    identified, where they did; `calibration.model` the calibrated one. `cad_alone` is what both stages find without these. `rigid` holds
    fits of the same robot without elasticity, the fairest one first; `rigid_verification` in the same order. Verifications on
    `verification_poses` are against the noise-free truth; `measured_verification`, at the same poses, is against the instrument, with
    `measured_covariance` as what is predicted of its errors. `floor` is the error that would remain with every parameter known, None of
    a robot that has other parameters than the model. `truth` maps parameter names to SI values. `before` are the errors of the nominal
    robot at the calibration poses; `nominal_verification` is of the same registered robot, and `own_verification` with the measured
    point found too. `results` is the document of results.json, `trust` the verdict in it, `seconds` durations by stage.
    """

    nominal: RobotModel
    informed: RobotModel
    plan: MultisinePlan
    responses: tuple[FrequencyResponse, ...]
    stiffness: SpringFit
    calibration: GeometricFit
    rigid: tuple[GeometricFit, ...]
    before: UncalibratedErrors
    verification_poses: PoseSet
    nominal_verification: PredictionErrors
    own_verification: PredictionErrors
    elastic_verification: PredictionErrors
    rigid_verification: tuple[PredictionErrors, ...]
    measured_verification: PredictionErrors
    measured_covariance: ErrorCovariance
    floor: ErrorStatistics | None
    truth: Mapping[str, float]
    dynamics: Estimate | None = None
    cad_alone: CadInertialsRun | None = None
    seconds: Mapping[str, float] = field(default_factory=dict)
    results: Mapping[str, Any] = field(default_factory=dict)
    trust: Trust = field(default_factory=Trust)
    seed: int = 0
    cell: CellName = "virtual"
    command: str = ""
