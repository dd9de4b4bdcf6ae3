"""The report of a study (`flexcal study`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.report.figures import task_distribution
from flexcal.report.layout import (
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Table,
    Verdict,
    counted,
    document_millimetres,
    listed,
    percent,
    significant,
    worst,
)
from flexcal.report.results import ABOUT_ALIKE, FEWEST_RESAMPLES, NOMINAL_COVERAGE, StudyTable, share_between
from flexcal.report.sections import (
    coverage_range,
    coverage_section,
    effects_section,
    provenance_section,
    resampling_section,
)

_NAMES = {
    "verification": "at fresh poses, against the truth",
    "measured": "at fresh poses, as the instrument reads them",
    "fit": "at the poses of the fit",
    "left_out": "at the measurements left out",
    "rigid": "calibrated as rigid, against the truth",
    "nominal": "nominal robot, registered, against the truth",
}
_KINDS = {
    "virtual_calibration": "calibrations of virtual robots",
    "two_stage": "two-stage calibrations of virtual robots",
    "calibrate": "calibrations on measured poses",
}
_NAMED = 3
"""Largest number of parameters that a sentence names."""
_COVERAGE_QUESTION = "Do the 95 % intervals hold the true values in 95 % of cases?"
_NEAR = 0.02
"""Distance of a share of intervals from 95 % that changes no decision: 93 to 97 %."""
_CLEARLY_LESS = 0.883
"""Share of intervals that hold the truth where standard deviations are stated a quarter too small: 2 Φ(1.96 / 1.25) − 1."""
_FEW_SEEDS = 20
"""Number of seeds from which a share of intervals that is too large says that they are."""
_LISTED = 100
"""Largest number of messages in a table."""


@dataclass(frozen=True, eq=False)
class StudyReport:
    """The document of a study, results.json, with the statistics of the rows of its `table`."""

    results: Mapping[str, Any]
    table: StudyTable


def study_page(study: StudyReport) -> Page:
    """The page before it becomes HTML."""
    results = study.results
    sections = [_errors_section(study)]
    sections += (
        []
        if not results["coverage"] or not results["coverage"]["tasks"]
        else [coverage_section(results["coverage"])]
    )
    sections += [effects_section(results, study.table)] if results["effects"] else []
    sections += [] if results["resampling"] is None else [resampling_section(results["resampling"])]
    sections += [_failures_section(results)] if results["failures"] else []
    sections.append(provenance_section(results["command"], None, {}, results["provenance"]))
    count = results["tasks"]
    return Page(
        title=f"{results['name']}: study of {count['total']} {_KINDS[results['study']]}",
        subtitle=f"{count['done']} of {count['total']} tasks have ended, {count['failed']} with an error",
        verdict=_verdict(results),
        sections=sections,
        document=results,
    )


def _verdict(results: Mapping[str, Any]) -> Verdict:
    checks = _checks(results)
    error = results["errors"].get(results["error"], {}).get("p90_mm")
    facts = []
    if error and error["tasks"]:
        range_ = f"{document_millimetres(error['low'])} to {document_millimetres(error['high'])} mm in {share_between(error)} of the tasks."
        words = _NAMES[results["error"]]
        facts.append(
            Fact(
                f"How large are the errors {words}?",
                document_millimetres(error["median"]),
                "mm",
                f"Median over the tasks of the 90th percentile of the errors; {range_}",
            )
        )
    covered = results["coverage"]
    if covered and covered["share"] is not None:
        detail = (
            f"95 % interval {coverage_range(covered)}."
            if covered["low"] is not None
            else "One task alone has no interval of this share."
        )
        facts.append(
            Fact(
                "Do the 95 % intervals hold the truth?",
                percent(covered["share"]),
                "",
                f"Share of all intervals; {detail}",
            )
        )
    if results["effects"]:
        facts.append(_effect_fact(results["effects"]))
    count = results["tasks"]
    headline = (
        counted(count["done"], "task")
        if count["done"] == count["total"]
        else f"{count['done']} of {count['total']} tasks; the study is not complete"
    )
    sentence = (
        f"{count['failed']} failed; a failed task is in no statistic." if count["failed"] else "None failed."
    )
    seconds = results["seconds"]
    if seconds["tasks"]:
        sentence += f" A task takes {significant(seconds['median'], 2)} s (median)."
    return Verdict(worst(checks), headline, sentence, tuple(facts), (), "", checks)


def _effect_fact(effects: Sequence[Mapping[str, Any]]) -> Fact:
    """The option with the largest effect of those that are not by chance."""
    question = "What drives the error most?"
    sure = [item for item in effects if not item["by_chance"]]
    if sure:
        single = [item for item in sure if item["levels"]] or sure
        first = max(single, key=lambda item: item["share"])
        return Fact(
            question,
            percent(first["share"]),
            "",
            f"of the variance between tasks is explained by {first['option']}.",
        )
    if all(item["p"] is None for item in effects):
        return Fact(
            question,
            "unknown",
            "",
            "Too few seeds, draws or data sets to tell an effect of an option from chance.",
        )
    return Fact(question, "nothing", "", "No option has an effect beyond chance.")


def _checks(results: Mapping[str, Any]) -> tuple[Check, ...]:
    count, covered = results["tasks"], results["coverage"]
    missing = count["total"] - count["done"]
    checks = [
        Check(
            "Have all tasks ended?",
            "Yes." if not missing else f"{missing} have not: 'flexcal study --resume' goes on.",
            "care" if missing else "good",
        ),
        Check(
            "Did all succeed?",
            f"{count['failed']} of {count['done']} failed; their messages are below."
            if count["failed"]
            else "Yes.",
            "care" if count["failed"] else "good",
        ),
    ]
    if covered and covered["low"] is not None:
        checks.append(_coverage_check(covered))
    elif results["has_truth"]:
        checks.append(Check(_COVERAGE_QUESTION, "Too few tasks to tell.", "unknown"))
    checks += [] if results["resampling"] is None else _resampling_check(results["resampling"])
    return tuple(checks)


def _coverage_check(covered: Mapping[str, Any]) -> Check:
    """Whether intervals hold the truth as often as they say; how far their sizes are off counts, not only that they surely are."""
    low, high = covered["low"], covered["high"]
    answer = f"{percent(covered['share'])} of the intervals hold the true value, 95 % interval of this share {coverage_range(covered)}"
    if low <= NOMINAL_COVERAGE <= high:
        if low < _CLEARLY_LESS:
            seeds = f"{covered['seeds']} seed{' is' if covered['seeds'] == 1 else 's are'}"
            answer += f": {seeds} too few to tell whether the stated uncertainties are too small; run {_FEW_SEEDS} or more"
            return Check(_COVERAGE_QUESTION, f"{answer}.", "unknown")
        return Check(_COVERAGE_QUESTION, f"{answer}.", "good")
    small = high < NOMINAL_COVERAGE
    near = low >= NOMINAL_COVERAGE - _NEAR and high <= NOMINAL_COVERAGE + _NEAR
    few = covered["seeds"] < _FEW_SEEDS
    size = f"{'a little ' if near else ''}too {'small' if small else 'large'}"
    answer += f": the stated uncertainties {'may be' if few else 'are'} {size} under these options"
    if covered["ratio"] is not None:
        times = f"{significant(covered['ratio'], 2)} times the stated standard deviations"
        answer += f"; errors are {times} (root mean square, median over the parameters)"
    if few:
        answer += f"; {covered['seeds']} seeds are few, run {_FEW_SEEDS} or more"
    return Check(
        _COVERAGE_QUESTION, f"{answer}.", "good" if near else "bad" if small else "unknown" if few else "care"
    )


def _resampling_check(block: Mapping[str, Any]) -> list[Check]:
    """Whether the spread over resamples is that which the fit states, as far as so many resamples tell."""
    middle, expected = block["ratio"], block["expected"]
    if middle is None or block["resamples"] < FEWEST_RESAMPLES:
        return []
    tolerated = ABOUT_ALIKE + 2 / np.sqrt(2 * (block["resamples"] - 1))
    beside = "" if expected < 1.05 else f"; a jackknife of sound data would have {significant(expected, 3)}"
    answer = (
        f"The spread over {block['resamples']} data sets is {significant(middle, 3)} times the stated one (median over the parameters"
        f"{beside})"
    )
    question = "Do resampled data spread the estimates as their standard deviations say?"
    if middle > tolerated * expected:
        return [Check(question, f"{answer}: the stated uncertainties are too small for these data.", "bad")]
    single = block["surely_larger"]
    if single:
        told = [f"{name} {significant(block['parameters'][name]['ratio'], 3)} times" for name in single]
        few = "that" if len(single) == 1 else "those"
        return [
            Check(
                question,
                f"{answer}, but that of {listed(told, _NAMED)}: more than chance explains, so the stated uncertainty of {few} is too small "
                "for these data.",
                "care",
            )
        ]
    if middle < expected / tolerated:
        shared = "they also hold errors that all resamples share, as those of the model at neighbouring poses"
        return [Check(question, f"{answer}: no sign that the stated ones are too small; {shared}.", "good")]
    return [Check(question, f"{answer}.", "good")]


def _errors_section(study: StudyReport) -> Section:
    results, rows = study.results, []
    for name, block in results["errors"].items():
        for key, label in (("mean_mm", "mean"), ("p90_mm", "90th percentile"), ("max_mm", "maximum")):
            item = block[key]
            cells = (document_millimetres(item[what]) for what in ("median", "low", "high"))
            rows.append((f"{_NAMES.get(name, name)}: {label}", *cells, str(item["tasks"])))
    columns = ("errors", "median / mm", "2.5 % / mm", "97.5 % / mm", "tasks")
    curves = {
        str(_NAMES.get(name, name)): study.table.numbers(f"{name}.p90_mm") for name in results["errors"]
    }
    blocks = [
        Table(
            "table-errors",
            "Errors of a task: median over the tasks, and the range of 95 % or, of fewer than 40, of all of them",
            columns,
            tuple(rows),
        ),
        FigureBlock(
            "figure-errors",
            "Distribution over the tasks",
            task_distribution(curves),
            "Each task counts once, by the 90th percentile of its errors.",
            "Cumulative distributions of the errors of tasks.",
        ),
    ]
    return Section("errors", "Errors", "", tuple(blocks))


def _failures_section(results: Mapping[str, Any]) -> Section:
    frequent = results["failures"][:_LISTED]
    rows = tuple(
        (item["code"] or "unexpected", item["error"], str(item["tasks"]), str(item["first"]))
        for item in frequent
    )
    caption = (
        "Messages of failed tasks"
        if len(frequent) == len(results["failures"])
        else f"The {_LISTED} most frequent messages of failed tasks"
    )
    table = Table(
        "table-failures",
        caption,
        ("code", "message", "tasks", "number of the first"),
        rows,
        text_columns=(1,),
    )
    return Section("failures", "Failed tasks", "", (table,))
