"""All headline numbers in one table, beside the published ones."""

from __future__ import annotations

from flexcal.calibration.verification import CALIBRATED, RIGID
from flexcal.report.layout import NOTHING, Block, Section, Table, Text, statistics_cells
from flexcal.report.results import PublishedValues, TwoStageStudy


def comparison_section(study: TwoStageStudy) -> Section:
    """The numbers of the run beside the paper's."""
    paper = study.paper
    fresh, identifiable = study.verification, study.determined
    errors = [
        ("calibration poses, before (the robot's own)", study.points.before, None),
        (
            "calibration poses, calibrated",
            study.points.statistics(CALIBRATED),
            paper.calibration if paper else None,
        ),
        ("fresh poses, before (the robot's own)", study.fresh.before, None),
        ("fresh poses, rigid calibration", study.fresh.statistics(RIGID), paper.rigid if paper else None),
        ("fresh poses, elastic calibration", fresh.all, paper.elastic if paper else None),
        ("… flank certain", fresh.unambiguous, None),
    ]
    columns = ["errors at", "poses", "mean / mm", "P90 / mm", "max / mm"]
    columns += [f"{paper.short}, 90 %", f"{paper.short}, worst"] if paper else []
    rows = []
    for label, ours, theirs in errors:
        published = statistics_cells(theirs)[1:] if paper else ()
        rows.append((label, str(ours.poses), *statistics_cells(ours), *published))
    counts = [
        ("geometric parameters modelled", str(identifiable.parameters), _number(paper, "parameters")),
        ("geometric parameters determined", str(identifiable.rank), _number(paper, "rank")),
        (
            "smallest singular value, relative",
            f"{identifiable.singular_values[identifiable.rank - 1]:.2g}",
            NOTHING,
        ),
    ]
    blocks: list[Block] = [
        Table("table-numbers", "Errors", tuple(columns), tuple(rows), strong=(4,)),
        Table(
            "table-counts",
            "Parameters",
            ("number", "this run", paper.short) if paper else ("number", "this run"),
            tuple(row if paper else row[:2] for row in counts),
        ),
    ]
    if paper is not None:
        blocks.append(Text((), "Before comparing", (*paper.remarks, f"Source: {paper.citation}.")))
    lead = "The procedure as run here and as published." if paper else "The numbers of this run in one place."
    return Section(
        "numbers", "All numbers beside the paper's" if paper else "All numbers", lead, tuple(blocks)
    )


def _number(paper: PublishedValues | None, key: str) -> str:
    value = getattr(paper, key) if paper is not None else None
    return NOTHING if value is None else str(value)
