"""The fits of a calibration: rigid, for the choice of the bearing axes, and with the selected terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexcal.calibration.diagnostics import BearingAxes, compare_bearings
from flexcal.calibration.error_model import TRANSMISSION
from flexcal.calibration.fit import (
    CONVERGED,
    PER_JOINT,
    FleetPrior,
    GeometricFit,
    LossName,
    StratifiedSample,
    are_tracked,
    enough_for_terms,
    fit_geometry,
    geometric_parameters,
    with_tolerance_prior,
)
from flexcal.calibration.kinds import LEAST_REGISTERED
from flexcal.calibration.measurement import OneFlank
from flexcal.calibration.term_selection import TermSelection, select_terms
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.jobs.calibration.remarks import outlying_stations
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

_YIELDING = PER_JOINT[0]
"""Term that poses which do not determine all parameters have by its prior."""
_MOST = 0.5
"""Ratio of the errors at left-out poses from which a wave is a fact of these gears, and no random effect of any gear's size."""
_COMPARED = 1e-4
"""Relative offset at which fits to most of the poses have converged, of which nothing but errors elsewhere is told."""


@dataclass(frozen=True)
class FitSettings:
    """How to fit: `terms`, None for those that cross-validation supports, and the rest as `calibrate` has it; `fleet` is its `prior`."""

    terms: tuple[str, ...] | None
    loss: LossName
    secant_scale: float
    elasticity: Literal["reestimated", "marginalised"]
    fleet: FleetPrior | None = None
    tolerances: bool = True


@dataclass(frozen=True, eq=False)
class Fits:
    """The `rigid` fit and the one of the `selected` terms, of a `model` with the bearing axes and the backlash that they have.

    `terms` are those asked for or selected, of which few poses may not support all; `kinds` those of the parameters whose tolerances have
    a factor in common that was estimated from the poses.
    """

    model: RobotModel
    terms: tuple[str, ...]
    rigid: GeometricFit
    bearings: BearingAxes | None
    selection: TermSelection | None
    selected: GeometricFit
    kinds: Mapping[str, str]

    @classmethod
    def of(
        cls,
        model: RobotModel,
        poses: PoseSet,
        settings: FitSettings,
        *,
        near: Fits | None = None,
        progress: Progress = silent,
    ) -> Fits:
        """Fit the nominal robot `model`, starting from the fits `near` of most of these poses, where there are some, and in their frame.

        Tolerances of manufacture are the prior of what the poses do not tell far better.
        """
        model = model.with_stations(poses.places)
        for station in poses.stations:
            model.station_index(station)
        loss, terms = settings.loss, settings.terms
        informed = _with_tolerances(model, poses, settings)
        # a yielding joint is a choice where there are enough poses for one
        assumed = (
            (_YIELDING,)
            if informed is not None
            and (are_tracked(poses) or not enough_for_terms(poses))
            and any(n.endswith(_YIELDING) for n in geometric_parameters(model, poses, (_YIELDING,)).names)
            else ()
        )
        kinds = {} if near is None else near.kinds
        if informed is not None:
            model, kinds = informed

        def fit(
            robot: RobotModel,
            chosen: Sequence[str],
            stage: str,
            start: GeometricFit | None,
            *,
            elastic: bool,
            frame: GeometricFit | None,
        ) -> GeometricFit:
            progress(stage, 0.0)
            calibration = fit_geometry(
                robot,
                poses,
                terms=chosen,
                elastic=elastic,
                elasticity=settings.elasticity,
                secant_scale=settings.secant_scale,
                loss=loss,
                fleet=settings.fleet,
                kinds=kinds,
                near=None if start is None else start.estimate.values,
                frame=frame,
                tolerance=CONVERGED if near is None else _COMPARED,
            )
            progress(stage, 1.0)
            return calibration

        base = _base(model)
        of_rigid, of_selected = (None, None) if near is None else (near.rigid, near.selected)
        rigid = fit(model, base, "rigid fit", of_rigid, elastic=False, frame=of_rigid)
        bearings = compare_bearings(
            model,
            lambda robot: fit(robot, (*base, TRANSMISSION), "bearing axes", None, elastic=True, frame=None),
        )
        if bearings is not None and bearings.declared is None and bearings.preferred is not None:
            model = model.with_bearings(bearings.preferred)
        if terms is None and not len(poses.pointed):
            # errors in mm, by which terms are selected, are not to be had
            terms = base
        elastic = bool(model.elastic)
        start = of_selected or rigid
        if terms is not None:
            same = not elastic and terms == base
            selected = (
                rigid
                if same
                else fit(model, terms, "selected fit", start, elastic=elastic, frame=of_selected)
            )
            return cls(model, terms, rigid, bearings, None, selected, kinds)
        good = poses.subset(np.setdiff1d(np.flatnonzero(~poses.tilted), rigid.estimate.outliers))
        for name, told in outlying_stations(poses, rigid.estimate.outliers).items():
            if np.sum(good.station == name) < LEAST_REGISTERED:
                raise FlexcalError("E-CAL-038", f"{told}.")
        alone = loss == "auto" and not poses.tilted.any()

        def fit_of(chosen: TermSelection) -> GeometricFit:
            found = _with_random_waves(chosen)
            return fit(chosen.model, found, "selected fit", start, elastic=elastic, frame=of_selected)

        def choose(robot: RobotModel, begin: GeometricFit) -> tuple[TermSelection, GeometricFit]:
            """Terms beyond the geometry, and the fit with them."""
            progress("terms", 0.0)
            chosen = select_terms(robot, good, begin if alone else None, assumed)
            progress("terms", 1.0)
            try:
                return chosen, fit_of(chosen)
            except OneFlank:
                if robot.backlash_joints:
                    raise
                reason = "the fitted robot rests on one flank at all poses, so it is not identifiable beside the offset"
                chosen = chosen.without("backlash", robot, reason)
                return chosen, fit_of(chosen)

        selection, selected = choose(model, rigid)
        found = _with_random_waves(selection)
        return cls(selection.model, found, rigid, bearings, selection, selected, kinds)

    def again(self, poses: PoseSet, settings: FitSettings) -> GeometricFit:
        """Fit of the same terms, with the same priors, to some of the poses; without backlash where these are on one flank of it."""
        same = replace(settings, terms=self.terms, tolerances=False)
        try:
            return Fits.of(self.model, poses, same, near=self).selected
        except OneFlank:
            terms = tuple(term for term in self.terms if term != "backlash")
            return Fits.of(self.model, poses, replace(same, terms=terms), near=self).selected


def _with_tolerances(
    model: RobotModel, poses: PoseSet, settings: FitSettings
) -> tuple[RobotModel, dict[str, str]] | None:
    """`with_tolerance_prior`, where readings say where a target was and no other robots are known."""
    if not settings.tolerances or settings.fleet is not None or not len(poses.pointed):
        return None
    return with_tolerance_prior(model, poses, settings.terms or (*_base(model), _YIELDING))


def _base(model: RobotModel) -> tuple[str, ...]:
    """Terms of the rigid fit."""
    return ("kinematic", "backlash") if model.backlash_joints else ("kinematic",)


def sampled(poses: PoseSet) -> PoseSet:
    """The poses that are fitted, a stratified sample of very many."""
    sample = StratifiedSample.of(poses)
    return poses if sample is None else poses.subset(sample.rows)


def _with_random_waves(selection: TermSelection) -> tuple[str, ...]:
    """Selected terms with all transmission errors as random effects, in place of those of single orders but what explains most errors."""
    means = {row.terms: max(row.order, row.workspace, row.single) for row in selection.considered}
    large = [
        row.term
        for row in selection.considered
        if row.taken
        and row.term is not None
        and means[row.terms] < _MOST * means.get(tuple(t for t in row.terms if t != row.term), np.nan)
    ]
    waves = [term for term in selection.terms if term.startswith(TRANSMISSION) and term not in large]
    return (*(term for term in selection.terms if term not in waves), TRANSMISSION)
