"""The checks behind the verdict on a calibration, from its results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import erfc, sqrt
from typing import Any

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.verification import PredictionErrors
from flexcal.estimation import Estimate
from flexcal.report.layout import Check, document_millimetres, millimetres, p_value
from flexcal.units import MILLIMETRE

CHANCE, MISSING = 1.35, 2.0
"""Ratio of observed to predicted errors exceeded by chance once in a hundred robots, and from which the model must lack something.
Errors at all poses come from one draw of the parameters, which counts as about two dozen independent numbers however many poses there are.
"""

FEW_POSES = 20
FEW_NUMBERS = 4.0
"""Number of independent numbers in the errors at all poses below which their size says little."""
OVERSTATED = 0.5
"""Noise over the stated sigma below which the stated one counts as wrong."""
CLEAR_GAP = 3.0
_UNLIKELY = 0.01
"""Probability below which a deviation is no chance."""
_PLACES = 9
"""Numbers of the place of an instrument and a point."""
BEYOND = 3.0
"""Ratio of predicted errors where the robot works to those near the poses of its calibration from which these do not tell it."""
INVISIBLE = 1e-3
"""Model error, mm, that no instrument sees."""


def check_fresh_poses(fitted: ErrorStatistics, fresh: ErrorStatistics) -> Check:
    """Check of the accuracy at enough poses outside the fit, and against that of the fit."""
    question = "Was it verified on poses outside the fit?"
    answer = (
        f"Yes, on {fresh.poses}: P90 is {millimetres(fresh.p90)} mm there and {millimetres(fitted.p90)} mm on the "
        f"{fitted.poses} poses of the fit."
    )
    if fresh.poses < FEW_POSES:
        return Check(question, f"{answer} These are few; verify on {FEW_POSES} or more.", "care")
    if fresh.p90 > 3 * fitted.p90:
        return Check(
            question,
            f"{answer} Errors at fresh poses are much larger: the model overfits or lacks a term.",
            "care",
        )
    return Check(question, answer, "good")


def check_unseen(fitted: Sequence[str]) -> Check:
    """Check that the calibration was fitted to none of the files; `fitted` names those that it was fitted to."""
    question = "Are the points outside the fit?"
    if fitted:
        which = " and ".join(fitted)
        return Check(
            question,
            f"No: it was fitted to {which}, so errors at other poses may be larger; verify on poses outside the fit.",
            "unknown",
        )
    return Check(question, "Yes: none of the files was used for the fit.", "good")


def check_enough(poses: int) -> Check:
    """Check that the number of poses suffices for a 90 % value."""
    question = "Were enough fresh poses measured?"
    if poses >= FEW_POSES:
        return Check(question, f"{poses} points; P90 rests on about {max(1, poses // 10)} of them.", "good")
    return Check(question, f"{poses} points are few; measure {FEW_POSES} or more.", "care")


def check_claimed_uncertainty(prediction: Mapping[str, Any] | None) -> Check:
    """Whether errors at poses outside the fit are as large as predicted; `prediction` is that of results.json, None where there is none."""
    question = "Are the errors as large as predicted?"
    if prediction is None:
        return Check(
            question,
            "Cannot be judged: there are no verification poses, or no predicted uncertainty.",
            "unknown",
        )
    ratio, low, high = (prediction[key] for key in ("ratio", "ratio_low", "ratio_high"))
    numbers = (
        f"The errors at {prediction['poses']} poses are {ratio:.2f} times the predicted size (95 % interval {low:.2f} to {high:.2f}), and "
        f"{100 * prediction['inside_95_percent']:.0f} % of them lie within the bound predicted for 95 %."
    )
    if prediction["verdict"] == "unknown":
        return Check(
            question,
            f"Cannot be judged: instrument noise of unknown size is part of the errors. {numbers}",
            "unknown",
        )
    if ratio > MISSING and low > 1:
        return Check(question, f"No, they are much larger: the model lacks a term. {numbers}", "bad")
    if ratio > CHANCE or low > 1:
        return Check(question, f"No, they are larger. {numbers}", "care")
    if prediction["freedom"] < FEW_NUMBERS:
        return Check(
            question, f"Cannot be judged: the errors are too strongly correlated. {numbers}", "unknown"
        )
    if high < 1:
        return Check(question, f"They are smaller. {numbers}", "good")
    return Check(question, f"Yes. {numbers}", "good")


def check_error_budget(
    estimate: Estimate, variances: Mapping[str, float | None], *, is_implausible: bool, held: bool = False
) -> Check:
    """Whether the residuals of the geometry are noise of instrument and robot; `variances` is that of results.json.

    `held`: the noise is that of a ball held in sockets.
    """
    question = (
        "Are the residuals noise of robot and ball?"
        if held
        else "Are the residuals noise of instrument and robot?"
    )
    if estimate.status != "converged":
        return Check(question, f"The fit did not converge: {estimate.message}.", "bad").named("residual")
    instrument, stated = variances["instrument_mm"], variances["stated_mm"]
    robot, model = (float(variances[key] or 0.0) for key in ("robot_mm", "model_mm"))
    said = "" if instrument is None else f"instrument {instrument:.3f}, "
    with_ = " (instrument included, because no sigma is stated)" if instrument is None else ""
    with_ = " (play of the ball in its socket included)" if held else with_
    answer = (
        f"Standard deviation of a coordinate: {said}robot {robot:.3f}{with_}, model error {model:.3f} mm."
    )
    if is_implausible:
        return Check(
            question,
            f"No: the data do not fit the robot as its files describe it; the remarks say what is implausible. {answer}",
            "bad",
        ).named("residual")
    if model > max(np.hypot(instrument or 0.0, robot), INVISIBLE):
        what = f"No: systematic model errors are larger than the noise. {answer}"
        return Check(question, what, "care").named("model_error")
    if instrument is not None and stated is not None and instrument < OVERSTATED * stated:
        what = f"Yes, but the stated sigma of {stated:.3g} mm is too large. {answer}"
        return Check(question, what, "care").named("residual")
    return Check(question, f"Yes. {answer}", "good").named("residual")


def check_residual(question: str, estimate: Estimate) -> Check:
    """Whether the measurement noise explains the residuals."""
    if estimate.status != "converged":
        return Check(question, f"The fit did not converge: {estimate.message}.", "bad")
    value = estimate.reduced_chi2
    answer = f"χ² per degree of freedom is {value:.2f}; one means that noise explains the residuals."
    if not np.isfinite(value) or value > 4:
        return Check(question, f"{answer} Model errors are much larger than the noise.", "bad")
    if estimate.unexplained:
        return Check(question, f"{answer} There are small model errors.", "care")
    if value < 0.4:
        return Check(question, f"{answer} The stated noise is too large.", "care")
    return Check(question, answer, "good")


def check_drift(drift: Mapping[str, Any]) -> Check:
    """Whether residuals drift with time; `drift` is the block of results.json."""
    question = "Did robot or instrument drift during the measurement?"
    if not drift["certain"]:
        return Check(question, f"No drift detected (p = {p_value(drift['p'])}).", "good")
    answer = (
        f"Residuals drift with time (p = {p_value(drift['p'])}), by {document_millimetres(drift['residual_mm'])} mm from the first "
        f"pose to the last; a drift of {document_millimetres(drift['distance_mm'])} mm beside the fit explains the readings best. Let "
        "robot and instrument warm up, or measure in random order if place and order are correlated."
    )
    return Check(question, answer, "care")


def check_lag(lag: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """Where joint positions and points were not read at the same instant while the robot moved; `lag` is the block of results.json."""
    if lag is None or not lag["certain"]:
        return ()
    size = (
        f"{abs(lag['lag']) * 1e3:.3g} ms"
        if lag["unit"] == "s"
        else f"{abs(lag['lag']):.2g} of the time from one row to the next"
    )
    answer = (
        f"No: the points are {'behind' if lag['lag'] > 0 else 'ahead of'} the joint positions by {size}, which explains "
        f"{lag['share']:.0%} of the squares of the residuals (p = {p_value(lag['p'])}). The robot moved while it was measured: let it "
        "stand still at every pose."
    )
    return (Check("Were joint positions and points read at the same instant?", answer, "bad").named("lag"),)


def check_extent(extent: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """Whether the robot is as accurate where it will work as near the poses of the fit; `extent` is the block of results.json."""
    if extent is None:
        return ()
    question = "Does it hold where the robot works?"
    inside, beyond = extent["inside_mm"], extent["beyond_mm"]
    answer = (
        f"Predicted errors are {document_millimetres(inside)} mm at the poses of the fit and {document_millimetres(beyond)} mm over the "
        f"{extent['of']} (rms)."
    )
    if beyond <= BEYOND * inside:
        return (Check(question, answer, "good").named("extent"),)
    told = f"Only near the calibrated poses, which the remarks give. {answer}"
    return (Check(question, told, "care").named("extent"),)


def check_size(size: Mapping[str, Any] | None) -> tuple[Check, ...]:
    """Whether declared lengths go together with the nominal ones of the robot; `size` is the block of results.json."""
    if size is None or not size["contradicted"]:
        return ()
    return (
        Check(
            "Is its size known?",
            "Lengths that it has its size from contradict each other by more than is declared of them; the remarks say by how much.",
            "care",
        ).named("size"),
    )


def check_rank(parameters: int, rank: int, gap: float) -> Check:
    """Whether the rank is unambiguous: a `gap` in decades between the parameters that are determined and the others."""
    question = "Is the rank of the identification clear?"
    dropped = parameters - rank
    answer = f"{rank} of {parameters} geometric parameters are determined; "
    if not dropped:
        return Check(question, f"{answer}none was dropped.", "good")
    clear = gap >= CLEAR_GAP
    answer += (
        f"the {dropped} others are absorbed by them, with a gap of {gap:.0f} decades between the two groups."
    )
    return Check(question, answer if clear else f"{answer} That gap is small.", "good" if clear else "care")


def check_springs(estimate: Estimate, stiffness: Sequence[str], damping: Sequence[str]) -> Check:
    """Whether the data determine every stiffness."""
    question = "Are all stiffnesses determined by the data?"

    def seen(names: Sequence[str]) -> int:
        return sum(estimate.interval(name) is not None for name in names)

    answer = f"{seen(stiffness)} of {len(stiffness)} stiffnesses and {seen(damping)} of {len(damping)} dampings are."
    if seen(stiffness) == len(stiffness):
        return Check(question, f"{answer} Damping does not affect accuracy at rest.", "good")
    return Check(
        question, f"{answer} The others keep the values of robot.yaml; change poses or payload.", "care"
    )


def check_flanks(verification: PredictionErrors) -> Check:
    """Whether the flank of every backlash is certain at every pose."""
    question = "Is the flank of the backlash certain at every pose?"
    unclear, all_ = int(verification.ambiguous.sum()), len(verification.ambiguous)
    if not unclear:
        return Check(question, f"Yes, at all {all_} verification poses.", "good")
    largest = float(np.linalg.norm(verification.errors[verification.ambiguous], axis=1).max())
    answer = (
        f"Not at {unclear} of {all_}: gravity hardly loads the joint there. The largest error at these poses is "
        f"{millimetres(largest)} mm, and {millimetres(verification.unambiguous.max)} mm at the others."
    )
    return Check(question, answer, "good" if unclear <= 0.1 * all_ else "care")


def check_truth(covered: int, total: int) -> Check:
    """Whether the 95 % intervals contain the truth, where it is known."""
    question = "Do the 95 % intervals contain the truth?"
    answer = (
        f"{covered} of {total} do ({100 * covered / total:.0f} %). Only a simulated robot has a known truth."
    )
    share = covered / total
    return Check(question, answer, "good" if share >= 0.88 else "care" if share >= 0.75 else "bad")


_ALL = 0.95
"""Predicted error, in that of the robot before, from which little is gained."""
_FRESH = "Measure fresh poses and run flexcal verify before relying on it."


def check_left_out(
    mean: float, left_out: float | None, expected: float | None, remedy: str = _FRESH
) -> Check:
    """Whether the cross-validation error is as small as expected from that of the fit.

    `mean` is the mean error (m) of the fit without its outliers, `left_out` that of poses left out, `expected` what that is on average
    where the scatter is all that there is (`CrossValidation.expected`). `remedy` is what to do where no pose was left out.
    """
    question = "Are poses left out of the fit predicted?"
    if left_out is None or expected is None:
        return Check(question, f"Cannot be judged: no pose was left out. {remedy}", "unknown")
    return _compared(question, "In cross-validation the mean error is", left_out, mean, expected)


def check_gain(
    before: Mapping[str, float] | None,
    left_out: float | None,
    fit: Mapping[str, Any],
    extent: Mapping[str, Any] | None,
) -> tuple[Check, ...]:
    """Where poses left out of the fit are met no better (mean error `left_out`, m) than by the uncalibrated robot, or the errors that are
    left open are nearly all that there were; `before`, `fit` and `extent` are of results.json.

    Of the uncalibrated robot six numbers of the instrument and three of the point are fitted to the same poses, see `check_held_out`.
    """
    question = "Is the robot more accurate than before?"
    if before is not None and left_out is not None:
        share = min(_PLACES / max(fit["coordinates"], 1), 0.9)
        uncalibrated = before["mean_mm"] * MILLIMETRE * float(np.sqrt((1 + share) / (1 - share)))
        if left_out >= uncalibrated:
            answer = (
                f"No: poses left out of the fit are met to {millimetres(left_out)} mm on average, and by the robot before, with its base "
                f"and point found, to {millimetres(uncalibrated)} mm. Look for wrong readings, and measure more poses."
            )
            return (Check(question, answer, "care").named("gain"),)
    corrected = None if extent is None else extent.get("corrected_mm")  # earlier results have none
    if extent is None or corrected is None:
        return ()
    open_ = extent["beyond_mm"]
    if open_ < _ALL * np.hypot(open_, corrected):
        return ()
    answer = (
        f"Hardly: over the {extent['of']} the calibration changes {document_millimetres(corrected)} mm and leaves "
        f"{document_millimetres(open_)} mm open (rms). Measure more poses, or by a better instrument."
    )
    return (Check(question, answer, "care").named("gain"),)


def check_held_out(held_out: Mapping[str, Any], mean: float, share: float) -> Check:
    """Whether groups that were left out are predicted as well as expected.

    `held_out` is the block of results.json, `mean` the mean error (m) of the fit, `share` the number of parameters over that of measured
    coordinates. A fit of p parameters to n values of variance σ² has residuals of variance σ² (1 − p/n) and prediction errors of variance
    σ² (1 + p/n), to first order.
    """
    groups = held_out["groups"]
    worst = max(groups, key=lambda name: groups[name]["mean_mm"])
    found = (
        f"With each of the {len(groups)} groups of equal '{held_out['by']}' left out in turn, the largest mean error at one is "
        f"{document_millimetres(groups[worst]['mean_mm'])} mm ({worst}), and the mean of all"
    )
    expected = float(np.sqrt((1 + share) / (1 - share))) * mean if share < 1 else mean
    question = "Are whole groups left out of the fit predicted?"
    return _compared(question, found, held_out["mean_mm"] * MILLIMETRE, mean, expected)


def _compared(question: str, found: str, left_out: float, mean: float, expected: float) -> Check:
    answer = f"{found} {millimetres(left_out)} mm; expected from {millimetres(mean)} mm in the fit are {millimetres(expected)} mm."
    if left_out > CHANCE * expected:
        return Check(
            question,
            f"{answer} It is {left_out / expected:.2f} times as large: the model overfits or lacks a term.",
            "care",
        )
    return Check(question, answer, "good")


def check_held_out_tilts(mean: float, share: float, held_out: Mapping[str, Any] | None) -> Check:
    """Whether readings of inclinometers that were held out are predicted, as `check_left_out`; `mean` error of the fit in mrad, `held_out`
    of results.json.
    """
    question = "Are readings outside the fit predicted?"
    if held_out is None:
        return Check(
            question,
            "Cannot be judged: none was held out. Calibrate with --hold-out and a column that tells recordings or poses apart.",
            "unknown",
        )
    left_out = held_out["mean_mrad"]
    expected = float(np.sqrt((1 + share) / (1 - share))) * mean if share < 1 else np.inf
    answer = (
        f"Held out by {held_out['by']}, the mean error is {left_out:.3g} mrad; expected from {mean:.3g} mrad in the fit are "
        f"{expected:.3g} mrad."
    )
    return Check(question, answer, "good" if left_out <= CHANCE * expected else "care")


def check_outliers(outliers: int, fit: ErrorStatistics) -> Check:
    """Whether there are outliers: the number of `outliers` of a robust loss, or the largest error relative to P90."""
    question = "Are there outliers?"
    if outliers:
        answer = f"{outliers} of {fit.poses} measurements have a weight below 0.2 in the robust loss; they are listed below."
        return Check(question, answer, "good" if outliers <= 0.02 * fit.poses else "care")
    if fit.max > 4 * fit.p90:
        return Check(
            question,
            f"The largest error, {millimetres(fit.max)} mm, is more than four times P90; check this measurement, or fit with "
            "--loss cauchy.",
            "care",
        )
    return Check(question, "No.", "good")


def check_known_points(uncalibrated: Sequence[str], *, held: bool) -> Check:
    """Check for points `uncalibrated`, measured in no calibration pose; `held`: balls in sockets."""
    return Check(
        "Did the calibration measure these points?",
        f"Not {' and '.join(uncalibrated)}: where it is on the tool is as declared, and an error of that is in these numbers. "
        + (
            "Calibrate with contacts of it."
            if held
            else "flexcal verify --refit point finds it from these poses."
        ),
        "care",
    )


def check_distances(distances: Sequence[Mapping[str, Any]]) -> tuple[Check, ...]:
    """Whether known distances between sockets are met as predicted; `distances` are those of results.json, none of which may be known."""
    errors, stds = (np.array([item[key] for item in distances], float) for key in ("error_mm", "std_mm"))
    if not len(errors) or not np.isfinite(stds).all():
        return ()
    question, worst = "Are the sockets as far apart as declared?", int(np.argmax(np.abs(errors) / stds))
    # of the largest deviation, by Bonferroni's bound
    chance = min(1.0, len(errors) * erfc(abs(float(errors[worst])) / float(stds[worst]) / sqrt(2)))
    answer = (
        f"{' to '.join(distances[worst]['sockets'])} at {distances[worst]['place']} are {errors[worst]:+.3f} mm off, with "
        f"{stds[worst]:.3f} mm predicted (1σ; p = {p_value(chance)} among {len(errors)})."
    )
    if chance < _UNLIKELY:
        return (
            Check(
                question,
                f"No: {answer} The fixture or the robot is larger or smaller than at the calibration.",
                "care",
                "distances",
            ),
        )
    return (Check(question, f"Yes, within chance: {answer}", "good", "distances"),)


def check_setup_unchanged(proposed: Mapping[str, Any]) -> Check:
    """Check for a placement whose refit would halve the errors, as in `refit_proposed` of results.json."""
    what = " and ".join(
        {"station": "instrument", "point": "measured point"}[name] for name in proposed["what"]
    )
    return Check(
        "Are instrument and measured point where they were at the calibration?",
        f"No: with the {what} placed again the mean error is {proposed['mean_mm']:.3f} mm. "
        f"flexcal verify --refit {' '.join(proposed['what'])} verifies the geometry alone.",
        "bad",
    )
