"""Calibrations on resampled measurements."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from flexcal.calibration.fit import GeometricFit
from flexcal.calibration.measurement import kind_names
from flexcal.data.poses import PoseSet, read_grouped_poses, read_poses, tables_of
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.files.formats import provenance, read_estimates
from flexcal.jobs.calibration import Fits, FitSettings, held_out_group, requested_terms, sampled
from flexcal.jobs.study.config import ResamplingConfig
from flexcal.jobs.study.measured_values import error_columns, fit_columns, parameter_columns
from flexcal.jobs.study.options import CalibrateOptions, structured
from flexcal.jobs.study.rows import StudyRow
from flexcal.jobs.study.tasks import StudyTasks
from flexcal.model.robot import RobotModel, unit_in, with_blocks

ALL = "all"
"""The data set as it was measured."""
BOOTSTRAP, WITHOUT = "bootstrap ", "without "
_OF_ROWS = {"pose": lambda poses: poses.pose, "station": lambda poses: poses.station}
_FEWEST_RESIDUALS = 4


@dataclass(frozen=True)
class ResampledCalibrations(StudyTasks):
    """Calibrates on the measurements, on those with residuals drawn anew, or without one group of them after the other.

    `labels` (N,) are the groups, where groups are left out.
    """

    model: RobotModel
    poses: PoseSet
    labels: np.ndarray | None
    resampling: ResamplingConfig | None
    origin: Mapping[str, str]
    options: ClassVar[type] = CalibrateOptions
    has_truth: ClassVar[bool] = False
    _fits: dict[str, Fits] = field(default_factory=dict, compare=False, repr=False)
    """Fits to all data, by options."""

    @classmethod
    def of(
        cls, robot: Path, paths: Sequence[Path], resampling: ResamplingConfig | None
    ) -> ResampledCalibrations:
        """Tasks on files of measured poses; raises `InputError` as reading does, and for a column that makes no groups."""
        bare = RobotModel.from_yaml(robot, estimates=False)
        source = bare.estimates_file
        blocks = read_estimates(source, without="calibration") if source.exists() else {}
        model = with_blocks(bare, blocks, source)
        listed, labels = tables_of(paths), None
        by = "" if resampling is None else resampling.leave_one_out
        if by and by not in _OF_ROWS:
            poses, labels = read_grouped_poses(listed, model, by)
        else:
            poses = read_poses(list(listed), model)
        if by in _OF_ROWS:
            labels = _OF_ROWS[by](poses).astype(str)
        count = len(np.unique(poses.pose))
        if by not in ("", *_OF_ROWS) and labels is not None and len(set(labels.tolist())) >= count:
            raise FlexcalError(
                "E-STUDY-026",
                f"'{by}' has another value at each of the {count} poses, so that it makes no groups; where every pose is to be left out "
                "by itself, write leave_one_out: pose.",
            )
        if resampling is not None and resampling.jackknife > count:
            raise FlexcalError(
                "E-STUDY-027",
                f"jackknife: {resampling.jackknife} asks for more groups than the {count} poses; write at most {count}.",
            )
        if resampling is not None and resampling.jackknife:
            labels = _random_groups(poses.pose, resampling)
        if labels is not None and len(set(labels.tolist())) < 2:
            raise FlexcalError(
                "E-STUDY-011",
                f"'{by or 'pose'}' is the same in all measurements; there is nothing to leave out by it.",
            )
        if resampling is not None and resampling.bootstrap and (poses.angled.any() or poses.tilted.any()):
            raise FlexcalError(
                "E-STUDY-012",
                "a bootstrap draws residuals of positions, and these measurements have orientations or inclinations; use jackknife or "
                "leave_one_out.",
            )
        origin = provenance([robot, bare.urdf, *listed], None, source if blocks else None, tuple(blocks))
        return cls(model, poses, labels, resampling, origin)

    @property
    def cell(self) -> Mapping[str, Any]:
        """As `StudyTasks.cell`: there is none."""
        return {}

    @property
    def error(self) -> str:
        """As `StudyTasks.error`: those at the group that is left out, where one is."""
        return "fit" if self.labels is None else "left_out"

    @property
    def resamples(self) -> Sequence[str]:
        """As `StudyTasks.resamples`: all data, then every resample."""
        if self.labels is not None:
            return [ALL, *(f"{WITHOUT}{name}" for name in dict.fromkeys(self.labels.tolist()))]
        count = 0 if self.resampling is None else self.resampling.bootstrap
        return [ALL, *(f"{BOOTSTRAP}{number}" for number in range(1, count + 1))]

    def unit(self, parameter: str) -> str:
        """As `StudyTasks.unit`, of joints that slide too."""
        return unit_in(self.model, parameter)

    def require(self, options: Mapping[str, Any]) -> None:
        """As `StudyTasks.require`: there are such terms."""
        requested_terms(self.model, structured(options, CalibrateOptions, {}).terms)

    def result(self, row: StudyRow) -> dict[str, Any]:
        """As `StudyTasks.result`."""
        options = structured(row.options, CalibrateOptions, {})
        whole = self._whole(row, options)
        columns: dict[str, Any] = {}
        if row.resample == ALL:
            fits = whole
        elif row.resample.startswith(BOOTSTRAP):
            number = int(row.resample.removeprefix(BOOTSTRAP))
            drawn = _with_residuals(whole, np.random.default_rng([row.seed, number]))
            fits = self._fitted(drawn, options, whole)
        else:
            out = self.labels == row.resample.removeprefix(WITHOUT)
            rest = self.poses.subset(~out)
            fits = self._fitted(sampled(rest), options, whole)
            left = self.poses.subset(out)
            if len(left.pointed):
                group = held_out_group(fits.selected.model, left.pointed, set(rest.station.tolist()))
                columns = error_columns("left_out", group.errors)
        fit = fits.selected
        return {
            **columns,
            **error_columns("fit", fit.errors),
            **fit_columns(fit.estimate, fit.variances),
            "freedom": fit.linear.freedom,
            "terms": " ".join(fits.terms),
            **parameter_columns(
                fit.estimate, other=_of_another_meaning(fit.estimate, whole.selected.estimate)
            ),
        }

    def _whole(self, row: StudyRow, options: CalibrateOptions) -> Fits:
        name = json.dumps(row.options, sort_keys=True)
        if name not in self._fits:
            self._fits[name] = self._fitted(sampled(self.poses), options, None)
        return self._fits[name]

    def _fitted(self, poses: PoseSet, options: CalibrateOptions, near: Fits | None) -> Fits:
        terms = requested_terms(self.model, options.terms)
        settings = FitSettings(terms, options.loss, options.secant_scale, options.elasticity)
        return Fits.of(self.model, poses, settings, near=near)


def _of_another_meaning(estimate: Estimate, whole: Estimate) -> frozenset[str]:
    """Parameters of a resample that took up others than in the fit to all data: as the places of all instruments do with another first
    one, in whose frame the base is.
    """
    own, there = estimate.absorbed, whole.absorbed
    return frozenset(name for name in estimate.parameters.names if own.get(name) != there.get(name))


def _with_residuals(fits: Fits, rng: np.random.Generator) -> PoseSet:
    """Fitted measurements plus residuals that are drawn, with replacement, among those of the same station and kind.

    Residuals are drawn in units of their standard deviations, as readings of another stated sigma scatter otherwise, and scaled by
    √(n / (n − p)), as they are smaller than the errors (Efron and Tibshirani 1993, section 9.4; Davison and Hinkley 1997, section 6.2.4).
    """
    fit = fits.selected
    poses, residuals = fit.poses, fit.residuals
    readings = poses.position.size if poses.kind is None else int(np.sum(residuals != 0))
    scale = np.sqrt(readings / max(readings - fit.estimate.rank, 1))
    position = poses.position - residuals
    std = _standard_deviations(fit)
    kinds = np.full(len(poses), "") if poses.kind is None else poses.kind
    for group in dict.fromkeys(zip(poses.station.tolist(), kinds.tolist(), strict=True)):
        rows = np.flatnonzero((poses.station == group[0]) & (kinds == group[1]))
        if len(rows) < _FEWEST_RESIDUALS:
            raise FlexcalError(
                "E-STUDY-013",
                f"station '{group[0]}' has {len(rows)} measurements, too few to draw residuals from; use jackknife or leave_one_out.",
            )
        own = residuals[rows] / std[rows]
        own -= own.mean(axis=0)
        position[rows] += scale * std[rows] * own[rng.integers(len(rows), size=len(rows))]
    return replace(poses, position=position)


def _standard_deviations(fit: GeometricFit) -> np.ndarray:
    """Standard deviations (N, 3), m, of measured coordinates: of the instrument as stated, of the robot and of the model error."""
    scatter, own = fit.scatter, np.full(len(fit.poses), fit.robot_scatter)
    for name in fit.linear.readings.instruments:
        own[kind_names(fit.poses) == name] = getattr(scatter, name)
    variance = (scatter.share * fit.poses.sigma) ** 2 + own[:, None] ** 2 + scatter.model**2
    return np.sqrt(np.where(variance > 0, variance, 1.0))


def _random_groups(pose: np.ndarray, resampling: ResamplingConfig) -> np.ndarray:
    """Labels (N,) of random groups of whole poses, as large as one another to one pose."""
    numbers = np.unique(pose)
    order = np.random.default_rng([resampling.seed, 0]).permutation(len(numbers))
    group = np.empty(len(numbers), dtype=int)
    group[order] = np.arange(len(numbers)) % resampling.jackknife + 1
    return np.array([f"group {group[k]}" for k in np.searchsorted(numbers, pose)])
