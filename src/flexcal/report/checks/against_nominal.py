"""Checks of a verification against the robot before the calibration, and against the calibration's own verdict."""

from __future__ import annotations

import numpy as np

from flexcal.report.layout import Check, millimetres, p_value

_QUESTION = "Is the robot more accurate than before?"
_CHANCE = 0.05
"""Probability under which a difference is no chance."""


def check_own_verdict(refused: str) -> tuple[Check, ...]:
    """Check of the calibration's own verdict; `refused` is why it was no, and there is no check where it was not."""
    if not refused:
        return ()
    return (
        Check(
            "Did the calibration itself pass its checks?",
            f"No: {refused}. Errors at these poses cannot make up for that; mend it, and calibrate again.",
            "bad",
            "own_verdict",
        ),
    )


def check_smaller_errors(before: np.ndarray, after: np.ndarray) -> Check:
    """Check whether distances (N,) m at the same poses fell, or rose, with the paired test of Wilcoxon (1945), one-sided.

    `before` are those of the nominal robot, larger by what was fitted to these poses to place it. Errors that rose are no reason for a no:
    where the calibration had few and noisy poses they are as predicted.
    """
    from scipy.stats import wilcoxon

    sizes = f"the mean error is {millimetres(after.mean())} mm, and {millimetres(before.mean())} mm before the calibration"
    smaller = bool(after.mean() < before.mean())
    of_sign = wilcoxon(before, after, alternative="greater" if smaller else "less")
    chance = float(np.asarray(of_sign)[1])
    if not smaller:
        answer = f"No: {sizes}, placed as well as possible. This calibration does not make the robot more accurate."
        return Check(_QUESTION, answer, "care", "worsening" if chance < _CHANCE else "improvement")
    if chance >= _CHANCE:
        answer = f"Perhaps: {sizes}, which may be chance (p = {p_value(chance)}); measure more poses."
        return Check(_QUESTION, answer, "care", "improvement")
    return Check(_QUESTION, f"Yes: {sizes} (p = {p_value(chance)}).", "good", "improvement")
