"""Checks of a verification on measured poses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.calibration.kinds import socket_numbers
from flexcal.calibration.verification import OWN, MeasuredPoints
from flexcal.report.checks.against_nominal import check_own_verdict, check_smaller_errors
from flexcal.report.checks.pose_errors import (
    check_claimed_uncertainty,
    check_distances,
    check_enough,
    check_flanks,
    check_known_points,
    check_lag,
    check_setup_unchanged,
    check_unseen,
)
from flexcal.report.layout import Check

_POINT = 3
_STATION = 6
"""Parameters of a point on the tool, and of the place of an instrument, which were fitted for the errors before."""


def verification_checks(results: Mapping[str, Any], points: MeasuredPoints) -> tuple[Check, ...]:
    """The checks behind the verdict; `results` is the document of results.json."""
    verification = points.verification
    flanks = (check_flanks(verification).named("flanks"),) if results["backlash"] else ()
    return (
        check_unseen(results["fitted"]).named("unseen_poses", independent=True),
        check_enough(verification.all.poses).named("enough_poses"),
        check_claimed_uncertainty(results["prediction"]).named("claimed_uncertainty", independent=True),
        *check_own_verdict(results.get("refused", "")),
        *check_lag(results.get("lag")),
        *_improvement(results, points),
        *check_distances(results.get("distances", ())),
        *flanks,
        *(
            (
                check_known_points(
                    results["uncalibrated_points"], held=bool(points.poses.in_socket.any())
                ).named("calibrated_points"),
            )
            if results.get("uncalibrated_points")
            else ()
        ),
        *(
            (check_setup_unchanged(results["refit_proposed"]).named("moved"),)
            if results.get("refit_proposed")
            else ()
        ),
    )


def _improvement(results: Mapping[str, Any], points: MeasuredPoints) -> tuple[Check, ...]:
    """Check against the uncalibrated robot; none where it is not known, or where a point or instrument elsewhere is part of the errors."""
    before = points.delivered
    if before is None or results.get("uncalibrated_points") or results.get("refit_proposed"):
        return ()
    poses = points.poses
    fitted = _POINT * len(poses.targets) if OWN in points.errors else 0
    numbers = 3 * len(poses)
    if poses.in_socket.any():  # of either robot the sockets are found from these contacts
        numbers -= _POINT * len(np.unique(socket_numbers(poses)))
    else:
        fitted += _STATION * len(poses.stations)
    sizes = np.linalg.norm(before, axis=1) / np.sqrt(1 - fitted / numbers)
    return (check_smaller_errors(sizes, np.linalg.norm(points.calibrated, axis=1)),)
