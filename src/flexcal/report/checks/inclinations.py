"""Checks of a calibration on inclinometers alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.calibration.verification import MILLIRADIAN, TiltStatistics
from flexcal.estimation import Estimate
from flexcal.report.checks.pose_errors import check_held_out_tilts, check_rank, check_residual
from flexcal.report.layout import Check
from flexcal.report.results import IdentifiableParameters


def inclination_checks(
    results: Mapping[str, Any], estimate: Estimate, after: TiltStatistics
) -> tuple[Check, ...]:
    """The checks behind the verdict."""
    seen = IdentifiableParameters.stored(results["identifiability"]["selected"])
    share = seen.rank / max(after.readings, 1)
    return (
        check_held_out_tilts(after.mean / MILLIRADIAN, share, results["held_out"]).named(
            "left_out", independent=True
        ),
        check_residual("Are the residuals noise of the inclinometers?", estimate).named("residual"),
        check_rank(seen.parameters, seen.rank, seen.gap).named("rank"),
    )
