"""The comparison of two runs (`flexcal report DIR --compare OTHER`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.files.formats import Block
from flexcal.report.figures import ErrorSeries, error_distribution
from flexcal.report.layout import (
    ELASTIC,
    NOTHING,
    RIGID,
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Status,
    Table,
    Text,
    Verdict,
    millimetres,
    scaled,
    significant,
    statistics_cells,
    worst,
)
from flexcal.report.layout import Block as PageBlock
from flexcal.report.results import LEVEL, Comparison, Run
from flexcal.report.sections import change_section, error_range
from flexcal.units import MILLIMETRE

_FEW = 20
_ANSWERS: dict[Status, str] = {"good": "Yes", "care": "With care", "bad": "No", "unknown": "Unknown"}


def comparison_page(comparison: Comparison) -> Page:
    """The page before it becomes HTML."""
    first, second = comparison.first, comparison.second
    sections = [_errors(comparison)]
    if comparison.change is not None or comparison.no_change_why:
        sections.insert(0, change_section(comparison))
    if comparison.single_changes:
        sections.append(_parameters(comparison))
    sections.append(_provenance(first, second))
    return Page(
        title=f"{first.name} and {second.name}: comparison",
        subtitle=f"Two runs of {first.kind} on the robot {first.robot}",
        verdict=comparison_verdict(comparison),
        sections=sections,
        document=comparison.document(),
    )


def comparison_verdict(comparison: Comparison) -> Verdict:
    """Verdict on which run is more accurate, by how much, and whether that is significant."""
    first, second, difference = comparison.first, comparison.second, comparison.difference
    checks = _checks(comparison)
    status = worst(checks)
    better, worse = (second, first) if difference.value < 0 else (first, second)
    size = millimetres(abs(difference.value))
    low, high = sorted(abs(bound) for bound in (difference.low, difference.high))
    if difference.significant:
        headline = f"{better.name} is more accurate than {worse.name} by {size} mm on average"
        sentence = (
            f"That is the difference of the mean errors. It is significant: its 95 % interval is {millimetres(low)} to "
            f"{millimetres(high)} mm."
        )
    else:
        headline = (
            f"{better.name} is {size} mm more accurate on average than {worse.name}, which is not significant"
        )
        sentence = (
            f"The 95 % interval of the difference, {_signed(difference.low)} to {_signed(difference.high)} mm ({second.name} minus "
            f"{first.name}), includes zero: at other points the opposite may hold."
        )
    if better.after.p90 > worse.after.p90:
        sentence += f" Yet P90 is smaller in {worse.name}."
    if comparison.verdict:
        sentence = f"The robot: {comparison.verdict}. {sentence}"
    facts = (
        *(
            Fact(
                f"How accurate is {run.name}?",
                millimetres(run.after.p90),
                "mm",
                f"P90 over the points. Mean {millimetres(run.after.mean)}, maximum {millimetres(run.after.max)} mm.",
            )
            for run in (first, second)
        ),
        Fact(
            "Does it hold for other points?",
            _ANSWERS[status],
            "",
            "Read below what the comparison rests on.",
            status,
        ),
    )
    ranges = []
    for run in (first, second):
        if run.before is not None:
            ranges.append(error_range(f"{run.name}, before", run.before, "nominal"))
        ranges.append(error_range(run.name, run.after, "rigid" if run is first else "elastic"))
    where = "fresh points" if first.fresh and second.fresh else "points"
    return Verdict(status, headline, sentence, facts, tuple(ranges), f"Error of the robot at {where}", checks)


def _checks(comparison: Comparison) -> tuple[Check, ...]:
    first, second = comparison.first, comparison.second
    seen = [run.name for run in (first, second) if not run.fresh]
    few = min(len(run.errors) for run in (first, second))
    return (
        Check(
            "Are the points outside both fits?",
            f"Not in {' and '.join(seen)}: the model with more terms always comes closer to the points it was fitted to. Verify both on "
            "the same fresh points, and compare these."
            if seen
            else "Yes, in both runs.",
            "care" if seen else "good",
        ),
        Check(
            "Were both measured at the same points?",
            "Yes: they are compared point by point, and what all points share cancels out."
            if comparison.difference.paired
            else "No: a run with easier points looks better, which the interval does not take into account.",
            "good" if comparison.difference.paired else "care",
        ),
        Check(
            "Were enough points measured?",
            f"{len(first.errors)} and {len(second.errors)}." + (" That is few." if few < _FEW else ""),
            "care" if few < _FEW else "good",
        ),
    )


def _errors(comparison: Comparison) -> Section:
    first, second, difference = comparison.first, comparison.second, comparison.difference
    rows = []
    for run in (first, second):
        if run.before is not None:
            rows.append((f"{run.name}, before", str(run.before.poses), *statistics_cells(run.before)))
        rows.append((run.name, str(run.after.poses), *statistics_cells(run.after)))
    series = [ErrorSeries(first.name, RIGID, first.errors), ErrorSeries(second.name, ELASTIC, second.errors)]
    return Section(
        "errors",
        "Errors side by side",
        "",
        (
            Table(
                "table-accuracy", "Distances", ("run", "points", "mean / mm", "P90 / mm", "max / mm"), tuple(rows)
            ),
            Text(
                (
                    f"{second.name} minus {first.name}, mean distance: {_signed(difference.value)} mm, 95 % interval "
                    f"{_signed(difference.low)} to {_signed(difference.high)} mm. "
                    + (
                        "The differences are taken point by point."
                        if difference.paired
                        else "The points differ, so the variances of both means are summed."
                    )
                    + " Errors are correlated in measuring order; the interval is from the means of up to twenty blocks.",
                ),
                "The difference",
            ),
            FigureBlock(
                "figure-distribution",
                "Cumulative distribution of the errors",
                error_distribution(series, {}),
                "P90 is where a curve crosses 90 %. Farther left is better.",
                f"Cumulative distributions; 90 % of points are within {millimetres(first.after.p90)} and "
                f"{millimetres(second.after.p90)} mm.",
            ),
        ),
    )  # fmt: skip


def _parameters(comparison: Comparison) -> Section:
    shared = comparison.shared
    words = (
        f"Both runs used {', '.join(shared)}, so their estimates are not independent: they share their noise, and differences come from "
        f"the model, the options or other measurements. The root of the summed variances is a scale here, not a test."
        if shared
        else "The runs share no measurement, so their estimates are independent: by chance, a difference exceeds 1.96 times the root of "
        f"the summed variances in {100 * LEVEL:.0f} of 100 parameters."
    )
    blocks: list[PageBlock] = []
    for block in comparison.single_changes:
        blocks += _changes(comparison, block)
    return Section(
        "parameters", "Parameters that changed by more than their uncertainty", words, tuple(blocks)
    )


def _changes(comparison: Comparison, block: Block) -> Sequence[PageBlock]:
    first, second, changes = comparison.first, comparison.second, comparison.changes[block]
    beyond = changes.beyond
    words = f"Of {len(changes.changes)} parameters that both determine, {len(beyond)} changed by more than their joint uncertainty."
    if not comparison.shared and changes.changes:
        chance = "less than 0.1 %" if changes.probability < 1e-3 else f"{100 * changes.probability:.2g} %"
        words += (
            f" By chance, about {LEVEL * len(changes.changes):.1f}; it makes all of them together as different in {chance} of "
            "all cases."
        )
    if changes.others:
        words += (
            f" {len(changes.others)} more cannot be compared: the runs dropped different parameters, so these estimate different "
            "combinations."
        )
    rows = []
    for change in beyond:
        factor, unit = scaled(change.unit)
        cells = [
            f"{significant(factor * value, 4)} ± {significant(factor * std, 2)}"
            for value, std in zip(change.values, change.std, strict=True)
        ]
        rows.append((change.name, unit, *cells, f"{change.score:+.1f}".replace("-", "−")))
    blocks: list[PageBlock] = [Text((words,), block.capitalize())]
    if rows:
        blocks.append(
            Table(
                f"table-{block}",
                f"Changes of the {block}, the largest first",
                ("parameter", "unit", f"{first.name} ± std", f"{second.name} ± std", "change / joint std"),
                tuple(rows),
                text_columns=(1,),
            )
        )
    return blocks


def _provenance(first: Run, second: Run) -> Section:
    names = list(dict.fromkeys([*first.origin, *second.origin]))
    rows = tuple((name, first.origin.get(name, NOTHING), second.origin.get(name, NOTHING)) for name in names)
    return Section(
        "provenance",
        "Provenance",
        "",
        (Table("table-provenance", "What made these runs", ("what", first.name, second.name), rows, text_columns=(1, 2)),),
    )  # fmt: skip


def _signed(value: float) -> str:
    """Millimetres with their sign."""
    return NOTHING if not np.isfinite(value) else f"{value / MILLIMETRE:+.3f}".replace("-", "−")
