"""The page of a corrected robot program (`flexcal filter --report`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.model.robot import RobotModel
from flexcal.report.figures import links_at, program_path
from flexcal.report.layout import (
    NOTHING,
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Selector,
    Slider,
    Table,
    Text,
    Verdict,
    document_millimetres,
    sentences,
    worst,
)
from flexcal.report.sections import ARROW_FACTORS, exaggeration, provenance_section

_LISTED = 1000
"""Largest number of targets in the table; of more, those that move most and those that stay."""
_SHOWN = "shift of every target"


@dataclass(frozen=True, eq=False)
class ProgramStudy:
    """A corrected program: `results` as the verb prints them, and the joint positions (n,) at its first corrected target, if any."""

    model: RobotModel
    results: Mapping[str, Any]
    q: np.ndarray | None


def program_page(study: ProgramStudy) -> Page:
    """The page before it becomes HTML."""
    results = study.results
    targets, left = results["targets"], results["left"]
    checks = program_checks(results)
    shifts = [item["shift_mm"] for item in targets]
    turns = [item["turn_deg"] for item in targets]
    facts = [
        Fact("How many targets are corrected?", str(len(targets)), "", f"{len(left)} stay as they are."),
    ]
    if targets:
        most = max(targets, key=lambda item: item["shift_mm"])
        facts += [
            Fact(
                "How far do they move?",
                document_millimetres(max(shifts)),
                "mm",
                f"Largest, in line {most['line']}; mean {document_millimetres(float(np.mean(shifts)))} mm.",
            ),
            Fact("How far do they turn?", f"{max(turns):.3f}", "°", "Largest angle of a target's rotation."),
        ]
    remarks = results["remarks"]
    sections = [
        *([_space(study)] if targets and study.q is not None else []),
        _table(results),
        *([Section("remarks", "Remarks", "", (Text((), "", sentences(remarks)),))] if remarks else []),
        provenance_section(results["command"], None, {}, results["provenance"]),
    ]
    return Page(
        title=f"{study.model.name}: corrected program",
        subtitle=", ".join(results["program"]),
        verdict=Verdict(
            worst(checks),
            f"{len(targets)} of {len(targets) + len(left)} targets corrected",
            _sentence(results),
            tuple(facts),
            (),
            "",
            checks,
        ),
        sections=sections,
        document=results,
    )


def program_checks(results: Mapping[str, Any]) -> tuple[Check, ...]:
    """Whether all targets were corrected, and whether anything is doubtful."""
    targets, left, remarks = results["targets"], results["left"], results["remarks"]
    question = "Are all targets corrected?"
    if not targets:
        first = Check(question, "None is; the table says why.", "bad")
    elif left:
        first = Check(
            question,
            f"{len(left)} of {len(targets) + len(left)} stay as they are; unless the controller computes them from corrected ones, "
            "the robot goes there with its uncalibrated error.",
            "care",
        )
    else:
        first = Check(question, f"All {len(targets)}.", "good")
    second = Check(
        "Does anything make the new numbers doubtful?",
        f"See the remarks ({len(remarks)})." if remarks else "Nothing that the program and robot.yaml say.",
        "care" if remarks else "good",
    )
    return (first.named("corrected"), second.named("remarks"))


def _sentence(results: Mapping[str, Any]) -> str:
    if results["reversed"]:
        return "The numbers of a corrected program are returned to those for the nominal robot."
    return (
        "The real robot reaches with the new numbers what the nominal robot would reach with the old ones, as far as its calibration is "
        "right: flexcal verify measures that. Run the new program slowly first."
    )


def _space(study: ProgramStudy) -> Section:
    assert study.q is not None
    results = study.results
    steps = sorted(
        (item for item in [*results["targets"], *results["left"]] if item["order"] is not None),
        key=lambda item: item["order"],
    )
    gap = [np.nan] * 3
    nominal, corrected = (
        np.array([item.get(key, gap) for item in steps], dtype=float)
        for key in ("nominal_xyz_m", "corrected_xyz_m")
    )
    shift = (corrected - nominal)[np.isfinite(corrected).all(axis=1)]
    extent = float(np.linalg.norm(np.nanmax(nominal, axis=0) - np.nanmin(nominal, axis=0)))
    factor = exaggeration(shift, max(0.15 * extent, 0.02))
    largest = document_millimetres(float(np.linalg.norm(shift, axis=1).max()) * 1e3)
    block = FigureBlock(
        "figure-path",
        "Path of the tool, as written and corrected",
        program_path(
            links_at(study.model, study.q[None])[0],
            nominal,
            corrected,
            [item["line"] for item in steps],
            _SHOWN,
            factor,
        ),
        "Tool centre points in the robot's base frame; of targets without a known tool the flange. Lines join them in the order of the "
        "program, with a gap where a target stays as it is; how the robot moves between them the program says. Arrows lead from the "
        f"written to the corrected target, exaggerated as chosen above; the longest is {largest} mm. The arm stands at the first target. "
        "Drag to rotate, Ctrl and the wheel to zoom.",
        f"Three-dimensional path of {len(shift)} targets with exaggerated arrows of their shifts; the longest is {largest} mm.",
        (Selector("Arrows", "arrows", (_SHOWN, "none")),),
        Slider("Exaggeration", "arrows", ARROW_FACTORS, {_SHOWN: factor, "none": factor}),
    )
    return Section("path", "Path", "", (block,))


def _table(results: Mapping[str, Any]) -> Section:
    every = [*results["targets"], *results["left"]]
    some = sorted(every, key=lambda item: -item.get("shift_mm", np.inf))[:_LISTED]
    several = len(results["program"]) > 1
    rows = []
    for item in sorted(some, key=lambda item: (item["file"], item["line"])):
        corrected = "shift_mm" in item
        rows.append(
            (
                f"{item['file']}:{item['line']}" if several else str(item["line"]),
                item["name"] if corrected else item["text"],
                item["motion"] if corrected else NOTHING,
                _numbers(item["before"]) if corrected else NOTHING,
                _numbers(item["after"]) if corrected else NOTHING,
                document_millimetres(item["shift_mm"]) if corrected else NOTHING,
                f"{item['turn_deg']:.3f}" if corrected else NOTHING,
                "" if corrected else item["reason"],
            )
        )
    caption = (
        "Target by target"
        if len(every) <= _LISTED
        else f"{_LISTED} of {len(every)} targets: those that stay, and those that move most"
    )
    table = Table(
        "table-targets",
        caption,
        ("line", "target", "motion", "as written", "corrected", "shift / mm", "turn / °", "why it stays"),
        tuple(rows),
        f"Numbers as the program has them, in {results['units']}. Shift and turn are those of the tool in the robot's base frame.",
        text_columns=(1, 2, 3, 4, 7),
    )
    return Section("targets", "Targets", "", (table,))


def _numbers(values: list[float]) -> str:
    texts = [f"{value:.6f}".rstrip("0").rstrip(".") for value in values]
    return ", ".join("0" if text == "-0" else text.replace("-", "−") for text in texts)
