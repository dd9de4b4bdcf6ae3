"""What the page says: of the next pose, of a row, and of what more poses bring."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexcal.studio.steps.measure.pose_card import pose_card
from flexcal.studio.steps.measure.pose_list import TONES, row_keys
from flexcal.studio.window import paragraph

if TYPE_CHECKING:
    from flexcal.studio.steps.measure.measuring import Measuring
    from flexcal.studio.steps.measure.next_pose import NextPose


def next_text(measuring: Measuring, following: NextPose | None) -> str:
    """HTML of the next pose, or of why there is none."""
    series = measuring.series
    if following is None:
        return _without_next(measuring)
    if series.plan is None:
        place = f"the best one after {len(series.rows)} rows; there is no {series.purpose.plan}"
    else:
        place = f"{measuring.reached} of {len({*series.plan.numbers.tolist()})} planned poses measured"
        if series.rows and not series.at_plan.any():
            place = f"{len(series.rows)} rows, none at a planned pose"
    return pose_card(series.model, following, place)


def row_text(measuring: Measuring, row: int) -> str:
    """HTML of the judgement of a row; of none where `row` is negative."""
    series = measuring.series
    if row < 0:
        return paragraph("no rows yet.", "faint")
    key = row_keys(series)[row]
    excluded = series.rows[row].excluded
    if excluded:
        return paragraph(f"pose {key} is excluded: {excluded}", "faint")
    judgement = measuring.judgements.get(row)
    if judgement is not None:
        return _large(paragraph(judgement.sentence, TONES[judgement.code]))
    if measuring.problem is not None:
        return paragraph(str(measuring.problem), "bad")
    return _large(paragraph(f"judging pose {key} …"))


def outlook_text(measuring: Measuring) -> str | None:
    """HTML of what more poses bring, and of what is wrong with the series; None while that is being worked out."""
    if measuring.series.purpose.is_check:
        return paragraph("more poses to verify on make the accuracy surer; 20 or more are usual.", "faint")
    answer, outlook = measuring.answer, measuring.outlook
    if answer is None or outlook is None:
        return None
    last, judged = len(answer.question.keys) - 1, list(measuring.judgements.values())
    said = {judgement.sentence for judgement in judged[-1:]}
    told = _large(paragraph(outlook.sentence, "good" if outlook.is_enough else "plain"))
    found = [
        finding.sentence
        for finding in answer.findings
        if finding.sentence not in said and (finding.kind, finding.row) != ("outlier", last)
    ]
    return told + "".join(paragraph(sentence, "warning") for sentence in found)


def _without_next(measuring: Measuring) -> str:
    series = measuring.series
    if series.plan is None and series.purpose.is_check and series.rows:
        return paragraph(
            f"{len(series.rows)} rows to verify on, and no plan of more: go on with step 5, Verify."
        )
    if series.plan is None and series.purpose.is_check:
        return paragraph(f"no {series.purpose.plan} yet: plan poses to verify on in step 2.", "warning")
    if measuring.is_complete:
        return _complete(measuring)
    if measuring.problem is not None:
        return paragraph(str(measuring.problem), "bad")
    return paragraph("choosing the next pose …")


def _complete(measuring: Measuring) -> str:
    """HTML where no planned pose is left to measure: how many have a row that can be used."""
    series = measuring.series
    count = 0 if series.plan is None else len({*series.plan.numbers.tolist()})
    reached, skipped = measuring.reached, len(measuring.skipped)
    step = "5, Verify" if series.purpose.is_check else "4, Calibrate"
    more = "" if series.purpose.is_check else ", or choose the order 'the best anywhere' for more poses"
    if reached == count:
        return paragraph(f"all {count} planned poses are measured: go on with step {step}{more}.", "good")
    if not reached:
        return paragraph(
            f"{len(series.rows)} rows, none of them a good one at a planned pose: see what is said of them before step {step}.",
            "bad",
        )
    left = f"{count - reached} are excluded, judged wrong or skipped"
    wrong = reached + skipped < count
    again = "; pick one of them in the list to measure it again" if wrong else ""
    return paragraph(
        f"{reached} of {count} planned poses are measured, {left}{again}: go on with step {step}{more}.",
        "warning" if wrong else "good",
    )


def _large(html: str) -> str:
    """Readable from the robot, and read aloud when it changes."""
    return f'<div aria-live="polite" style="font-size:1.15em;">{html}</div>'
