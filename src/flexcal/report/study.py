"""Everything that a two-stage calibration found, bundled for its report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from flexcal.calibration import Calibration, ErrorStatistics, Verification
from flexcal.data import MultisinePlan, PoseSet
from flexcal.elasticity import StiffnessResult
from flexcal.estimation import Estimate
from flexcal.frequency import FrequencyResponse
from flexcal.model import RobotModel
from flexcal.report.publication import Publication

MAXWELL_MEAN = 1.5958
"""Mean distance over 1σ of a coordinate, for errors alike in three directions."""


@dataclass(frozen=True, eq=False)
class CadAlone:
    """Both stages fitted again, to the same data, with the inertials of CAD in place of those that trajectories identified."""

    stiffness: StiffnessResult
    calibration: Calibration
    verification: Verification


@dataclass(frozen=True, eq=False)
class TwoStageStudy:
    """One robot, both stages, and how they were checked.

    `nominal` is the robot of the data sheet; `informed` what both stages start from, with the inertials `dynamics` that trajectories
    identified, where they did; `calibration.model` the calibrated one. `cad_alone` is what both stages find without these. `rigid` holds
    fits of the same robot without elasticity, the fairest one first; `rigid_verification` in the same order. Verifications on
    `verification_poses` are against the noise-free truth where `truth` is known, otherwise against the instrument;
    `measured_verification` is against the instrument, on `measured_poses`. `floor` is the error that would remain with every parameter
    known. `truth` maps parameter names to SI values.
    `results` is the document of results.json, `seconds` durations by stage.
    """

    nominal: RobotModel
    informed: RobotModel
    plan: MultisinePlan
    responses: tuple[FrequencyResponse, ...]
    stiffness: StiffnessResult
    calibration: Calibration
    rigid: tuple[Calibration, ...]
    nominal_at_calibration: Verification
    verification_poses: PoseSet
    nominal_verification: Verification
    elastic_verification: Verification
    rigid_verification: tuple[Verification, ...]
    dynamics: Estimate | None = None
    cad_alone: CadAlone | None = None
    measured_poses: PoseSet | None = None
    measured_verification: Verification | None = None
    floor: ErrorStatistics | None = None
    truth: Mapping[str, float] | None = None
    paper: Publication | None = None
    seconds: Mapping[str, float] = field(default_factory=dict)
    results: Mapping[str, Any] = field(default_factory=dict)
    seed: int | None = None
    command: str = ""

    @property
    def reference(self) -> str:
        """What verification errors are measured against, in words."""
        return "the noise-free truth" if self.truth is not None else "the instrument"

    def springs(self, kind: Literal["stiffness", "damping"]) -> tuple[str, ...]:
        """Names of all stiffnesses or all dampings of drives and bearings."""
        return tuple(name for name in self.stiffness.springs if name.endswith(f".{kind}"))

    @property
    def unpredicted_noise(self) -> np.ndarray | None:
        """1σ (N, 3) m of what verification errors hold beyond the parameters': the instrument's noise, or against the truth the floor."""
        if self.truth is None:
            return self.verification_poses.sigma
        if self.floor is None:
            return None
        return np.full(self.verification_poses.position.shape, self.floor.mean / MAXWELL_MEAN)
