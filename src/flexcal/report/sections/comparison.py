"""All headline numbers in one table, beside the published ones."""

from __future__ import annotations

from flexcal.calibration import ErrorStatistics
from flexcal.report.notation import NOTHING, millimetres
from flexcal.report.page import Block, Section, Table, Text
from flexcal.report.publication import Publication
from flexcal.report.study import TwoStageStudy


def comparison_section(study: TwoStageStudy) -> Section:
    """The numbers of the run beside the paper's."""
    paper = study.paper
    rows = [
        *_error_rows("calibration poses", study.calibration.errors, paper.calibration if paper else None),
        *_error_rows("fresh poses, with elasticity", study.elastic_verification.all, paper.elastic if paper else None),
        *_error_rows("fresh poses, rigid model", study.rigid_verification[0].all, paper.rigid if paper else None),
        ("geometric parameters modelled", str(len(study.calibration.identifiability.names)), _number(paper, "parameters")),
        ("geometric parameters determined", str(study.calibration.identifiability.rank), _number(paper, "rank")),
        ("poses of the frequency experiment", str(len(study.responses)), "3" if paper else NOTHING),
    ]
    blocks: list[Block] = [
        Table(
            "table-numbers",
            "All numbers",
            ("", "this run", paper.short if paper else "published"),
            tuple(rows),
        )
    ]
    if paper is not None:
        blocks.append(Text((), "Before comparing", (*paper.remarks, f"Source: {paper.citation}.")))
    lead = "The same procedure, run here and published." if paper else "The numbers of this run in one place."
    return Section("numbers", "All numbers beside the paper's" if paper else "All numbers", lead, tuple(blocks))


def _error_rows(
    label: str, ours: ErrorStatistics, theirs: ErrorStatistics | None
) -> list[tuple[str, str, str]]:
    rows = []
    for name, key in (("mean", "mean"), ("90 % within", "p90"), ("worst", "max")):
        published = millimetres(getattr(theirs, key)) if theirs else NOTHING
        text = f"{millimetres(getattr(ours, key))} mm"
        rows.append((f"{label} ({ours.poses}), {name}", text, published if published == NOTHING else f"{published} mm"))
    return rows


def _number(paper: Publication | None, key: str) -> str:
    value = getattr(paper, key) if paper is not None else None
    return NOTHING if value is None else str(value)
