"""Checks of predicted errors against measured poses, for a map and a certificate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flexcal.calibration.verification import ErrorScale
from flexcal.report.checks.against_nominal import check_own_verdict
from flexcal.report.checks.pose_errors import FEW_POSES, check_claimed_uncertainty, check_enough, check_unseen
from flexcal.report.layout import Check
from flexcal.units import MILLIMETRE

_BETTER = "Is the robot more accurate than before?"


def prediction_checks(
    scale: ErrorScale | None, fitted: Sequence[str], refused: str = ""
) -> tuple[Check, ...]:
    """The checks behind the verdict: `scale` is None where nothing was measured, `fitted` names the files that the fit has used,
    and `refused` is why the calibration's own verdict was no.
    """
    document = None if scale is None else scale.document()
    claimed = check_claimed_uncertainty(document)
    if scale is not None and scale.verdict == "optimistic" and claimed.status == "good":
        answer = f"No: those of parameters and model are {scale.factor:.2f} times the predicted size. {claimed.answer}"
        claimed = replace(claimed, answer=answer, status="care")
    checks = [*check_own_verdict(refused), claimed.named("claimed_uncertainty", independent=True)]
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


def check_improvement(before: float, after: float) -> Check:
    """Check whether mean errors (m) at the same targets fell by the compensation, both with instrument and point registered by best fit."""
    sizes = f"from {before / MILLIMETRE:.3f} to {after / MILLIMETRE:.3f} mm"
    if after < before:
        return Check(_BETTER, f"Yes: {sizes}, each after a best fit.", "good", "improvement")
    return Check(
        _BETTER,
        f"No: the mean error goes {sizes}, each after a best fit. Were the compensated commands sent, and then measured?",
        "bad",
        "improvement",
    )
