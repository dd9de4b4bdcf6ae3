"""Exported file of a robot, with the error due to terms that the format lacks."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import dropwhile
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.export.offset_fit import nominal_error
from flexcal.export.representation_error import (
    DrawPoses,
    ExportErrors,
    PositionErrors,
    ToolMap,
    leave_out,
    poses_of,
    tool_positions,
)
from flexcal.files.transaction import write_text
from flexcal.model.robot import RobotModel
from flexcal.printable import one_line


@dataclass(frozen=True, eq=False)
class RenderedModel:
    """Rendered robot: `text`, and `tool`, the target's position when that text is read back.

    `tool` is None for a file without geometry. `unrepresented` are the terms that the format has no place for; `about` says in
    sentences what stands in the file, for its header; `remarks` what a reader of it must know besides; `table` is what to show of it.
    """

    text: str
    tool: ToolMap | None
    unrepresented: tuple[str, ...]
    comments: Literal["<!--", "#"] | None
    about: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    table: dict[str, Any] = field(default_factory=dict)
    point: str | None = None


@dataclass(frozen=True, eq=False)
class ExportedFile:
    """Written file, its representation error, and remarks; `table` are its rows."""

    path: Path
    loss: ExportErrors
    remarks: tuple[str, ...]
    table: dict[str, Any]

    def __str__(self) -> str:
        return " ".join([f"{self.path}:", *self.loss.sentences, *self.remarks])

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the terms that the file does not represent."""
        return self.loss.terms


def measure_export_error(
    model: RobotModel,
    tool: ToolMap,
    terms: Sequence[str],
    *,
    point: str | None = None,
    nominal: RobotModel | None = None,
    draw: DrawPoses | None = None,
) -> ExportErrors:
    """Error of a file that puts the target at `tool` and lacks `terms`; only those that `model` has count.

    The robot carries its declared payload. The poses are those of `draw`, as `poses_of` takes it; over them the error of the `nominal`
    robot is measured too, its base and point fitted.
    """
    present = tuple(term for term in terms if leave_out(model, term) is not model)
    payload = model.payload_mass
    if not model.points:
        return ExportErrors(present, None, 0, "joint range", payload)
    q, within = poses_of(model, draw)(point, np.random.default_rng(0))
    full, _ = tool_positions(model, q, point=point)
    beside = None if nominal is None else nominal_error(nominal, q, full, model.point(point).name)
    return ExportErrors(present, PositionErrors.of(full - tool(q)), len(q), within, payload, beside)


def write_rendered(
    model: RobotModel,
    path: str | Path,
    rendered: RenderedModel,
    *,
    nominal: RobotModel | None = None,
    draw: DrawPoses | None = None,
) -> ExportedFile:
    """Measure the representation error of `rendered` against `model`, and write it with that in its header; raises `InputError` if not
    possible. `nominal` and `draw` are as `measure_export_error` takes them.
    """
    if rendered.tool is None:
        loss = ExportErrors((), None, 0, "joint range", model.payload_mass, geometry=False)
    else:
        loss = measure_export_error(
            model, rendered.tool, rendered.unrepresented, point=rendered.point, nominal=nominal, draw=draw
        )
    lines = [f"{model.name}, written by flexcal.", *rendered.about, *loss.sentences, *rendered.remarks]
    write_text(path, _with_header(rendered.text, lines, rendered.comments))
    return ExportedFile(Path(path), loss, rendered.remarks, rendered.table)


def rows_of(text: str) -> Iterator[dict[str, str]]:
    """Rows of a CSV table by column, without the comments of its header."""
    lines = dropwhile(lambda line: line.startswith("#"), text.splitlines())
    return iter(csv.DictReader(lines))


def _with_header(text: str, lines: list[str], comments: str | None) -> str:
    if comments is None:
        return text
    lines = [one_line(line) for line in lines]
    if comments == "#":
        return "".join(f"# {line}\n" for line in lines) + text
    body = "\n".join(f"  {re.sub('-(?=-)', '- ', line)}" for line in lines)
    declaration, text = text.split("\n", 1) if text.startswith("<?xml") else ('<?xml version="1.0"?>', text)
    return f"{declaration}\n<!--\n{body}\n-->\n{text}"
