"""Whether errors at measured poses are what the calibration predicts, for the pages of a map and a certificate."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.calibration import ErrorScale
from flexcal.report.checks import FEW_POSES, MISSING, check_enough, check_unseen
from flexcal.report.page import Check


def prediction_checks(scale: ErrorScale | None, fitted: Sequence[str]) -> tuple[Check, ...]:
    """The checks behind the verdict: `scale` is None where nothing was measured, `fitted` names the files that the fit has used."""
    checks = [_check_prediction(scale).named("claimed_uncertainty", independent=True)]
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


def _check_prediction(scale: ErrorScale | None) -> Check:
    question = "Are the errors as large as predicted?"
    if scale is None:
        return Check(
            question,
            "Cannot be judged: nothing was verified. Measure poses that the calibration never saw and give them with --verification.",
            "unknown",
        )
    numbers = (
        f"Errors at {len(scale.probability)} measured poses are {scale.factor:.2f} times the predicted size (95 % interval {scale.low:.2f} "
        f"to {scale.high:.2f}), and {100 * scale.inside:.0f} % of them lie within the bound predicted for 95 %."
    )
    match scale.verdict:
        case "right":
            return Check(question, f"Yes. {numbers}", "good")
        case "cautious":
            return Check(question, f"They are smaller. {numbers}", "good")
        case "unknown":
            return Check(
                question,
                f"Cannot be judged: the instrument's noise is part of the errors. {numbers}",
                "unknown",
            )
        case _:
            return Check(
                question, f"No, they are larger. {numbers}", "bad" if scale.factor > MISSING else "care"
            )
