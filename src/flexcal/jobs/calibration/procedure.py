"""Calibration from measured positions: rigid fit, bearing axes, selection of terms, final fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from flexcal.calibration.comparison import TEMPERATURE
from flexcal.calibration.diagnostics import FleetConflict
from flexcal.calibration.error_model import TRANSMISSION
from flexcal.calibration.fit import (
    LEVELS,
    PER_JOINT,
    THERMAL,
    FleetPrior,
    GeometricFit,
    LossName,
    StratifiedSample,
    all_errors,
)
from flexcal.calibration.measurement import kind_names
from flexcal.calibration.term_selection import cross_validated
from flexcal.calibration.verification import uncalibrated_model, uncalibrated_orientations
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.files.formats import provenance
from flexcal.jobs.calibration.copied_rows import distinct_rows, without_copies
from flexcal.jobs.calibration.deviating_parameters import without_deviating
from flexcal.jobs.calibration.extent import Extent
from flexcal.jobs.calibration.fits import Fits, FitSettings, sampled
from flexcal.jobs.calibration.fitted_measurements import measurement_digests
from flexcal.jobs.calibration.held_out import held_out_errors
from flexcal.jobs.calibration.held_out_tilts import held_out_tilts
from flexcal.jobs.calibration.joint_ranges import joint_extents
from flexcal.jobs.calibration.odd_temperatures import plausible_temperatures, with_plausible_temperatures
from flexcal.jobs.calibration.result import Calibration
from flexcal.jobs.inputs import is_station_identified
from flexcal.model.robot import READINGS, TARGETS, TARGETS_BETWEEN, ZERO_DRIFT, RobotModel
from flexcal.progress import Progress, silent

AUTO = "auto"


def calibrate(
    model: RobotModel,
    poses: PoseSet,
    *,
    terms: Sequence[str] | None = None,
    loss: LossName = "auto",
    secant_scale: float = 0.0,
    elasticity: Literal["reestimated", "marginalised"] = "reestimated",
    hold_out: tuple[str, np.ndarray] | None = None,
    prior: FleetPrior | None = None,
    tolerances: bool = True,
    progress: Progress = silent,
) -> Calibration:
    """Calibrate the geometry of a robot from measured points, with its elastic deflection taken into account.

    A rigid fit, the choice of the bearing axes where robot.yaml leaves them open, the selection of terms by cross-validation and the
    final fit, as 'flexcal calibrate' does them (Neubauer et al. 2015, sections 3 and 5).

    Parameters
    ----------
    model : RobotModel
        Nominal robot, with the dynamics and stiffness that were identified, and without an earlier calibration:
        ``RobotModel.from_yaml(path, without="calibration")``.
    poses : PoseSet
        Joint positions (N, n) in rad or m and measured points (N, 3) in m, with orientations where they were measured. Its sigma is
        that of the instrument; the scatter of robot and model are estimated from the points. Of very many points a stratified sample is
        fitted.
    terms : sequence of str, optional
        Names of the error terms, or "auto" alone for those that cross-validation supports; by default as robot.yaml declares.
    loss : {"auto", "squares", "huber", "cauchy"}
        Loss function; "auto" takes the robust "cauchy" where squares leave outliers.
    secant_scale : float
        Relative standard deviation of the ratio of each drive's secant stiffness under gravity to its tangent stiffness.
    elasticity : {"reestimated", "marginalised"}
        How the uncertainty of stiffness and inertia enters; both give the same estimate to first order.
    hold_out : tuple of str and ndarray, optional
        Name and labels (N,) of groups of measurements. Each group is left out in turn of another calibration, with terms selected anew,
        and compared with it: `Calibration.held_out`.
    prior : FleetPrior, optional
        Prior of the geometry from other robots of the model, as `flexcal fleet --prior` writes it. Its terms are fitted, and those asked
        for. Parameters in which the robot deviates from the others beyond chance, up to three, are estimated without the prior.
    tolerances : bool
        Whether tolerances of manufacture are the prior of all errors where the points do not determine them all: of fewer than 20 poses, or
        of poses in a small region. Without, what they do not determine stays nominal.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    Calibration
        Its `model`, `estimate`, `residuals`, `errors`, `summary()`, `report(path)` and `write(folder)`; its `robot` is what `verify`,
        `predict`, `compensate` and `accuracy_map` take.

    Raises
    ------
    FlexcalError
        For a robot that has been calibrated already, an unknown term, fewer coordinates than
        parameters, joints that never move, and stations that robot.yaml does not know.

    Examples
    --------
    Kinematic terms only, from some of the measured poses; without `terms`, cross-validation selects them.

    >>> from flexcal import RobotModel, calibrate, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> calibration = calibrate(model, poses, terms=["kinematic"])
    >>> print(f"{calibration.errors.mean * 1e3:.1f} mm at {len(poses)} poses")
    0.1 mm at 77 poses
    """
    _require_uncalibrated(model)
    distinct = distinct_rows(poses)
    poses = without_copies(poses, distinct)
    plausible = plausible_temperatures(poses)
    if hold_out is not None:
        hold_out = (hold_out[0], hold_out[1][distinct][plausible])
    nominal, measured = model, with_plausible_temperatures(poses, plausible)
    sample = StratifiedSample.of(measured)
    poses = measured if sample is None else measured.subset(sample.rows)
    requested = requested_terms(model, terms)
    if prior is not None:
        _require_others(prior, measured)
        requested = _with_prior(prior, requested)
    settings = FitSettings(requested, loss, secant_scale, elasticity, prior, tolerances)
    fits = Fits.of(nominal, poses, settings, progress=progress)
    conflict = FleetConflict.of(fits.selected)
    if prior is not None and conflict is not None:
        released = without_deviating(
            prior,
            conflict,
            lambda own: Fits.of(nominal, poses, replace(settings, fleet=own), progress=progress),
        )
        if released is not None:
            own, fits, conflict = released
            settings = replace(settings, fleet=own)
    held_out = None
    if hold_out is not None:
        progress("held out", 0.0)
        kept = (
            _without_wrong_readings(measured, fits.rigid) if sample is None else np.ones(len(measured), bool)
        )
        compare = held_out_errors if len(measured.pointed) else held_out_tilts
        held_out = compare(
            lambda rest: fits.again(sampled(rest), settings).model,
            measured.subset(kept),
            hold_out[0],
            hold_out[1][kept],
            left_out=int((~kept).sum()),
        )
        progress("held out", 1.0)
    selected = fits.selected
    options = {
        "terms": " ".join(fits.terms),
        "loss": loss,
        "secant_scale": secant_scale,
        "elasticity": elasticity,
        TARGETS.removeprefix("option."): TARGETS_BETWEEN.join(poses.targets),
        READINGS.removeprefix("option."): TARGETS_BETWEEN.join(dict.fromkeys(kind_names(poses.pointed))),
    } | ({"bearings": fits.model.bearings} if fits.model.has_bearings else {})
    extent = Extent.of(selected)
    ranges = joint_extents(selected.model, selected.poses.q) | _temperatures(selected.poses)
    estimate = replace(
        selected.estimate,
        provenance=provenance((), options),
        ranges=ranges if extent is None else ranges | extent.range_of_errors,
        measurements=measurement_digests(poses),
    )
    uncalibrated = uncalibrated_model(fits.model, poses)
    return Calibration(
        model=selected.model,
        estimate=estimate,
        nominal=nominal,
        before=uncalibrated.errors(poses.pointed),
        rigid=fits.rigid,
        selection=fits.selection,
        selected=selected,
        bearings=fits.bearings,
        validated=None
        if (fits.selection is None and prior is None) or poses.tilted.any()
        else cross_validated(selected),
        sample=sample,
        everywhere=None if sample is None else all_errors(selected.model, measured, progress),
        held_out=held_out,
        orientation_before=uncalibrated_orientations(uncalibrated.registered, poses),
        conflict=conflict,
        extent=extent,
    )


def _temperatures(poses: PoseSet) -> dict[str, tuple[float, float]]:
    """Range of the temperatures, °C, where they were measured."""
    measured = poses.temperature
    return {} if measured is None else {TEMPERATURE: (float(measured.min()), float(measured.max()))}


def _without_wrong_readings(poses: PoseSet, fit: GeometricFit) -> np.ndarray:
    """Mask (N,) without the outliers of a fit among distances and contacts, which somebody typed or touched wrongly."""
    wrong = np.isin(np.arange(len(poses)), fit.estimate.outliers)
    return np.ones(len(poses), bool) if poses.kind is None else ~(wrong & (poses.kind != ""))


def _require_uncalibrated(model: RobotModel) -> None:
    if any(is_station_identified(model, station) for station in model.stations.names):
        raise FlexcalError(
            "E-RUN-095",
            f"{model.name} has been calibrated already, and its points would count twice; read it with "
            "RobotModel.from_yaml(path, without='calibration').",
        )


def requested_terms(model: RobotModel, given: Sequence[str] | None) -> tuple[str, ...] | None:
    """Terms to fit, those of robot.yaml where none are given; None for those that cross-validation supports.

    Raises `FlexcalError` for a term that there is not, and for terms that exclude each other.
    """
    declared = model.config.geometry.terms
    asked = tuple(given) if given else ((declared,) if isinstance(declared, str) else declared)
    if asked == (AUTO,):
        return None
    harmonics = tuple(f"transmission_{order}" for order in model.drives.harmonics)
    known = (*LEVELS, "backlash", *PER_JOINT, TRANSMISSION, *harmonics, "ratio", *THERMAL)
    of_a_joint = (*PER_JOINT, ZERO_DRIFT)
    for term in asked:
        owner, _, kind = term.rpartition(".")
        if owner:
            model.joint_index(owner)
        if kind not in (of_a_joint if owner else known):
            raise FlexcalError(
                "E-RUN-011",
                f"there is no geometry term '{term}'; there are {', '.join(known)}, or {AUTO} alone.",
            )
    if "backlash" in asked and not model.backlash_joints:
        raise FlexcalError(
            "E-RUN-012",
            f"the term backlash is asked for but {model.path} names no joint with it; add `geometry: {{backlash: [joint]}}`.",
        )
    levels = [term for term in LEVELS if term in asked]
    if len(levels) > 1:
        raise FlexcalError(
            "E-RUN-104",
            f"each of {', '.join(LEVELS)} has those before it in it; give one, not {' and '.join(levels)}.",
        )
    return tuple(dict.fromkeys([*(levels or ["kinematic"]), *asked]))


def _require_others(prior: FleetPrior, poses: PoseSet) -> None:
    """Raise `FlexcalError` where measurements are of a robot that the prior is from."""
    own = measurement_digests(poses)
    for robot, digests in prior.measurements.items():
        again = len(set(digests).intersection(own))
        if again:
            raise FlexcalError(
                "E-PRIOR-010",
                f"{again} of these {len(own)} measurements are of {robot}, which the prior is from, and would count twice; calibrate it "
                "without --prior, or pool the other robots alone.",
            )


def _with_prior(prior: FleetPrior, requested: Sequence[str] | None) -> tuple[str, ...]:
    """Terms of a fit with a prior: those of the prior, and those asked for beside them."""
    if not prior.terms:
        raise FlexcalError(
            "E-PRIOR-020",
            "the prior does not say with which terms its robots were calibrated; make it again with 'flexcal fleet'.",
        )
    further = [term for term in requested or () if term not in prior.terms]
    levels = [term for term in further if term in LEVELS]
    if levels and levels[0] != "kinematic":
        raise FlexcalError(
            "E-PRIOR-011",
            f"the prior is of robots with the terms {', '.join(prior.terms)}, so {levels[0]} alone cannot be fitted with it; leave "
            f"{levels[0]} out, or leave out --prior.",
        )
    further = [term for term in further if term not in LEVELS]
    return tuple(dict.fromkeys([*prior.terms, *further, TRANSMISSION]))
