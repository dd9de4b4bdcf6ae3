"""Calibrations of virtual robots from measured positions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import GeometricFit, fit_geometry
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.plans import PosePlan
from flexcal.data.poses import PoseSet
from flexcal.design.poses import random_poses, select_poses
from flexcal.design.scene import CollisionChecker, MeasuringSetup
from flexcal.jobs.calibration import Fits, FitSettings, requested_terms
from flexcal.jobs.study.measured_values import error_columns, fit_columns, parameter_columns
from flexcal.jobs.study.options import VirtualCalibrationOptions, structured
from flexcal.jobs.study.rows import StudyRow
from flexcal.jobs.study.tasks import StudyTasks
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell import VirtualCell

_TRUTH, _POSES, _FRESH = range(3)
"""Streams of random numbers of a seed."""


@dataclass(frozen=True)
class VirtualCalibrations(StudyTasks):
    """Draws the true parameters of a robot from the seed, measures it, calibrates, and compares with the truth at fresh poses.

    `checker` is of the `nominal` robot: with it tasks need no files.
    """

    nominal: RobotModel
    checker: CollisionChecker
    settings: Mapping[str, Any]
    origin: Mapping[str, str]
    options: ClassVar[type] = VirtualCalibrationOptions
    has_truth: ClassVar[bool] = True

    @property
    def cell(self) -> Mapping[str, Any]:
        """As `StudyTasks.cell`."""
        return self.settings

    def require(self, options: Mapping[str, Any]) -> None:
        """As `StudyTasks.require`: there are such terms."""
        chosen = structured(options, VirtualCalibrationOptions, self.settings)
        if chosen.terms:
            requested_terms(self.nominal, chosen.terms)

    def result(self, row: StudyRow) -> dict[str, Any]:
        """As `StudyTasks.result`."""
        options = structured(row.options, VirtualCalibrationOptions, self.settings)
        cell, truth = VirtualCell.drawn(self.nominal, options.cell, row.seed)
        setup = MeasuringSetup()
        choose = random_poses if options.plan == "random" else _most_informative
        checker = self.checker
        rng = np.random.default_rng([row.seed, _POSES])
        plan = choose(self.nominal, options.poses, rng, setup, checker=checker)
        measured = cell.measure(plan)
        fit = self._fitted(measured, options)
        rng = np.random.default_rng([row.seed, _FRESH])
        fresh = random_poses(self.nominal, options.verification_poses, rng, setup, checker=checker)
        seen = cell.measure(fresh)
        errors = cell.noise_free(fresh) - predict_measurements(fit.model, seen).position
        return {
            **error_columns("verification", ErrorStatistics.of(errors)),
            **error_columns("fit", fit.errors),
            **fit_columns(fit.estimate, fit.variances),
            **parameter_columns(fit.estimate, truth),
        }

    def _fitted(self, poses: PoseSet, options: VirtualCalibrationOptions) -> GeometricFit:
        model = self.nominal
        default = ("kinematic", "backlash") if model.backlash_joints else ("kinematic",)
        terms = requested_terms(model, options.terms or default)
        if terms is None:
            return Fits.of(model, poses, FitSettings(None, options.loss, 0.0, "reestimated")).selected
        elastic = options.elastic and bool(model.elastic)
        return fit_geometry(model, poses, terms=terms, elastic=elastic, loss=options.loss)


def _most_informative(
    model: RobotModel,
    count: int,
    rng: np.random.Generator,
    setup: MeasuringSetup,
    *,
    checker: CollisionChecker,
) -> PosePlan:
    return select_poses(model, count, rng=rng, setup=setup, checker=checker).plan
