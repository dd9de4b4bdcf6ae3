"""Checks of a verification on measured poses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.calibration.verification import MeasuredPoints
from flexcal.report.checks.pose_errors import (
    check_claimed_uncertainty,
    check_enough,
    check_flanks,
    check_known_points,
    check_setup_unchanged,
    check_unseen,
)
from flexcal.report.layout import Check


def verification_checks(results: Mapping[str, Any], points: MeasuredPoints) -> tuple[Check, ...]:
    """The checks behind the verdict; `results` is the document of results.json."""
    verification = points.verification
    flanks = (check_flanks(verification).named("flanks"),) if results["backlash"] else ()
    return (
        check_unseen(results["fitted"]).named("unseen_poses", independent=True),
        check_enough(verification.all.poses).named("enough_poses"),
        check_claimed_uncertainty(results["prediction"]).named("claimed_uncertainty", independent=True),
        *flanks,
        *(
            (check_known_points(results["uncalibrated_points"]).named("calibrated_points"),)
            if results.get("uncalibrated_points")
            else ()
        ),
        *(
            (check_setup_unchanged(results["refit_proposed"]).named("moved"),)
            if results.get("refit_proposed")
            else ()
        ),
    )
