"""The poses of a series with what became of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from flexcal.studio.window import Tone, picked_rows, pose_keys

if TYPE_CHECKING:
    from flexcal.jobs.guidance import Judgement, JudgementCode
    from flexcal.studio.steps.measure.next_pose import NextPose
    from flexcal.studio.steps.measure.series import Series

TONES: dict[JudgementCode, Tone] = {
    "good": "good",
    "repeat": "good",
    "too_early": "plain",
    "moved": "warning",
    "drift": "warning",
    "outlier": "bad",
    "wrong_row": "bad",
    "axes": "bad",
    "unit": "bad",
    "misfit": "bad",
}
_WORDS: dict[JudgementCode, str] = {
    "good": "✓ good",
    "repeat": "✓ repeat",
    "too_early": "· measured",
    "moved": "! moved",
    "drift": "! drift",
    "outlier": "✗ outlier",
    "wrong_row": "✗ wrong row",
    "axes": "✗ axes",
    "unit": "✗ unit",
    "misfit": "✗ misfit",
}


def row_keys(series: Series) -> list[str]:
    """Key of every row in the selection."""
    return pose_keys(series.numbers.tolist())


def pose_list(
    series: Series,
    judgements: Mapping[int, Judgement],
    following: NextPose | None,
    skipped: frozenset[int],
    chosen: str | None,
    *,
    height: str,
) -> str:
    """HTML: the next pose, the rows with the latest first, and the poses that are left; `judgements` by row."""
    lines: dict[str, tuple[str, ...]] = {}
    keys = row_keys(series)
    if following is not None:
        key = str(following.number)
        before = series.rows[keys.index(key)].excluded if key in keys else ""
        if key in keys and not series.at_plan[keys.index(key)] and following.planned:
            before = f"the row of number {key} has other joint values"
        lines[key] = (f"pose {key}", "→ next", before)
    for row in reversed(range(len(keys))):
        lines.setdefault(keys[row], (f"pose {keys[row]}", *_state(series, row, judgements.get(row))))
    plan = series.plan
    numbers = [] if plan is None else plan.numbers[series.open_poses].tolist()
    for number in numbers:
        lines.setdefault(str(number), (f"pose {number}", "skipped" if number in skipped else "", ""))
    return picked_rows(("pose", "state", "off / mm, or reason"), lines, chosen, height=height)


def _state(series: Series, row: int, judgement: Judgement | None) -> tuple[str, str]:
    excluded = series.rows[row].excluded
    if excluded:
        return "– excluded", excluded
    if judgement is None:
        return "· measured", ""
    off = "" if judgement.error is None else f"{judgement.error * 1e3:.3f}"
    return _WORDS[judgement.code], off
