"""Checks of predicted errors against measured poses, for a map and a certificate."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.calibration.verification import ErrorScale
from flexcal.report.checks.pose_errors import FEW_POSES, check_claimed_uncertainty, check_enough, check_unseen
from flexcal.report.layout import Check


def prediction_checks(scale: ErrorScale | None, fitted: Sequence[str]) -> tuple[Check, ...]:
    """The checks behind the verdict: `scale` is None where nothing was measured, `fitted` names the files that the fit has used."""
    document = None if scale is None else scale.document()
    checks = [check_claimed_uncertainty(document).named("claimed_uncertainty", independent=True)]
    if scale is None:
        return tuple(checks)
    if fitted:
        checks.append(check_unseen(fitted).named("unseen_poses", independent=True))
    if not scale.noise_known:
        checks.append(
            Check(
                "Is the instrument's noise known?",
                "No: the files state no sigma, so the noise counts as an error of the robot. State it with flexcal import --sigma.",
                "care",
                "instrument_noise",
            )
        )
    if len(scale.probability) < FEW_POSES:
        checks.append(check_enough(len(scale.probability)).named("enough_poses"))
    return tuple(checks)
