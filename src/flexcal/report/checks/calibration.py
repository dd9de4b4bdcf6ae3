"""Checks of a calibration on measured poses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.verification import CALIBRATED, MeasuredPoints
from flexcal.estimation import Estimate
from flexcal.report.checks.bearing_axes import check_bearings
from flexcal.report.checks.elastic_model import check_misfit, read_misfit
from flexcal.report.checks.fleet_prior import check_fleet, check_pooled_stiffness
from flexcal.report.checks.places import check_places
from flexcal.report.checks.pose_errors import (
    check_drift,
    check_error_budget,
    check_extent,
    check_gain,
    check_held_out,
    check_lag,
    check_left_out,
    check_outliers,
    check_rank,
    check_size,
)
from flexcal.report.checks.temperature import check_instrument_change, check_temperature_sensor
from flexcal.report.layout import Check
from flexcal.report.results import IdentifiableParameters
from flexcal.units import MILLIMETRE


def calibration_checks(
    results: Mapping[str, Any], estimate: Estimate, points: MeasuredPoints
) -> tuple[Check, ...]:
    """The checks behind the verdict; `results` is the document of results.json."""
    identifiable, errors = (
        IdentifiableParameters.stored(results["identifiability"]["selected"]),
        points.statistics(CALIBRATED),
    )
    validated = results["cross_validation"]
    left_out = None if validated is None else validated["mean_mm"] * MILLIMETRE
    expected = None if validated is None else validated["expected_mm"] * MILLIMETRE
    parameters = identifiable.rank if validated is None else validated["parameters"]
    share = parameters / max(results["fit"]["coordinates"], 1)
    groups, held = results["held_out"], in_sockets(points)
    remedy = "Run it with --hold-out COLUMN" + (
        "." if held else ", or measure fresh poses and run flexcal verify, before relying on it."
    )
    inside = np.setdiff1d(np.arange(errors.poses), list(estimate.outliers))
    good = ErrorStatistics.of(points.calibrated[inside]).mean if len(inside) else errors.mean
    return (
        *(
            [check_left_out(good, left_out, expected, remedy).named("left_out", independent=True)]
            if groups is None or left_out is not None
            else []
        ),
        *(
            []
            if groups is None
            else [check_held_out(groups, errors.mean, share).named("groups_left_out", independent=True)]
        ),
        *check_gain(results["before"]["own"], left_out, results["fit"], results.get("extent")),
        check_error_budget(
            estimate, results["variances"], is_implausible=results["fit"]["is_implausible"], held=held
        ),
        check_rank(identifiable.parameters, identifiable.rank, identifiable.gap).named("rank"),
        *_checks_of_drift(results),
        *check_lag(results.get("lag")),
        check_outliers(len(estimate.outliers), errors).named("outliers"),
        *([] if results.get("places") is None else [check_places(results["places"])]),
        *check_bearings(results.get("bearings")),
        *check_fleet(results.get("fleet")),
        *check_pooled_stiffness(results.get("pooled_stiffness")),
        *_stage_one_checks(results.get("stage1")),
        *check_size(results.get("size")),
        *check_extent(results.get("extent")),
    )


def _checks_of_drift(results: Mapping[str, Any]) -> tuple[Check, ...]:
    """Whether anything drifted, in the residuals or in what terms of temperature took up, and whether these are measured well enough."""
    drift, told = results["drift"], results.get("temperature")
    if told is None:
        return () if drift is None else (check_drift(drift).named("drift"),)
    changed = told["instrument_mm"] is not None
    # what the instrument's term took up is no drift of the residuals any more
    return (
        *([] if drift is None or (changed and not drift["certain"]) else [check_drift(drift).named("drift")]),
        *([check_instrument_change(told)] if changed else []),
        *check_temperature_sensor(told, results["fit"]),
    )


def _stage_one_checks(stage_one: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """Whether the springs that the calibration began from explain the frequency responses that they came from."""
    return () if stage_one is None else (check_misfit(read_misfit(stage_one["misfit"])),)


def in_sockets(points: MeasuredPoints) -> bool:
    """Whether every measurement is of a ball in a socket."""
    return len(points.poses) > 0 and bool(points.poses.in_socket.all())
