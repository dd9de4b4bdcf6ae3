"""Carrying out a study, and its results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexcal.errors import InputError
from flexcal.files.formats import provenance
from flexcal.jobs.pages import report_folder
from flexcal.jobs.result_files import (
    KEY,
    NUMBER,
    RESULTS,
    TASKS,
    has_rows,
    header,
    read_results,
    read_study_rows,
    remove_rows,
    write_results,
    write_tasks,
)
from flexcal.jobs.study.measured_values import QUANTITIES
from flexcal.jobs.study.store import FIRST, OPTION, StudyStore, exclusive, option_cell
from flexcal.jobs.study.study_file import StudyPlan
from flexcal.jobs.study.tasks import run_row
from flexcal.parallel import Workers
from flexcal.progress import Progress, silent
from flexcal.report.results import StudyTable, study_statistics

if TYPE_CHECKING:
    import polars

STAGE = "tasks"


@dataclass(frozen=True)
class StudyRun:
    """A study in its folder; `remarks` tell of parts that could not be read."""

    plan: StudyPlan
    folder: Path
    command: str = ""
    remarks: tuple[str, ...] = ()
    _origin: dict[str, str] = field(default_factory=dict)

    def document(self, frame: polars.DataFrame) -> dict[str, Any]:
        """The content of results.json with the rows that are stored."""
        plan, tasks = self.plan, self.plan.tasks
        failed = int(frame["error"].is_not_null().sum()) if "error" in frame.columns else 0
        document = {
            **header("study"),
            "study": plan.config.kind,
            "name": plan.path.stem,
            "tasks": {"total": len(plan.rows), "done": len(frame), "failed": failed},
            "options": _varied(plan),
            "has_truth": tasks.has_truth,
            "error": tasks.error,
            "remarks": list(self.remarks),
            "units": {
                name: tasks.unit(name)
                for name in dict.fromkeys(column.rpartition(".")[0] for column in frame.columns)
                if f"{name}.estimate" in frame.columns
            },
        }
        statistics = study_statistics(StudyTable.of(frame, document))
        return document | statistics | {"provenance": dict(self._origin), "command": self.command}

    def finish(self) -> dict[str, Any]:
        """Write tasks.parquet, results.json and report.html, and return the document."""
        frame = self._frame()
        write_tasks(self.folder, frame)
        document = self.document(frame)
        write_results(self.folder, document)
        report_folder(self.folder)
        return document

    def _frame(self) -> polars.DataFrame:
        """Stored rows in the order of the plan, with columns in an order that does not depend on which task ended first."""
        import polars

        numbers = {row.key: number for number, row in enumerate(self.plan.rows)}
        frame = read_study_rows(self.folder).frame
        current = frame[KEY].replace_strict(numbers, default=None, return_dtype=polars.Int64)
        return (
            frame.with_columns(current.alias(NUMBER)).sort(NUMBER).select(sorted(frame.columns, key=_place))
        )


def _place(column: str) -> tuple[int, int, str, int]:
    """Place of a column: what the task is given, its results, then parameters by name."""
    owner, _, quantity = column.rpartition(".")
    if column in FIRST:
        return 0, FIRST.index(column), "", 0
    if column.startswith(OPTION):
        return 1, 0, column, 0
    if quantity in QUANTITIES:
        return 3, 0, owner, QUANTITIES.index(quantity)
    return 2, 0, column, 0


def run_study(
    plan: StudyPlan,
    folder: Path,
    workers: Workers,
    *,
    resume: bool = False,
    command: str = "",
    progress: Progress = silent,
    publishing: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> dict[str, Any]:
    """Carry out the tasks of a study that are not stored yet, and write tasks.parquet, results.json and report.html in its folder.

    A row of each task is stored soon after it ends.

    Parameters
    ----------
    plan : StudyPlan
        The study.
    folder : Path
        Folder of its results.
    workers : Workers
        Where the tasks run.
    resume : bool
        Whether rows that an interrupted study stored in the folder are taken; those that cannot be read run again.
    command : str
        The command line, if any.
    progress : Progress
        Called with the share of the tasks that have ended.
    publishing : callable
        Makes the context in which files take their places in the folder.

    Returns
    -------
    dict
        The content of results.json.

    Raises
    ------
    InputError
        Where there is a study already and no `resume`, where the study has been changed since other than by further rows, and where another
        process is at work in the folder.
    FlexcalError
        Where rows cannot be stored, as on a full disk, and where the workers are lost: what has been stored stays.
    """
    origin = {**plan.tasks.origin, "option.kind": plan.config.kind}
    declared = provenance([plan.path])
    with exclusive(folder):
        there = any((folder / name).is_file() for name in (RESULTS, TASKS)) or has_rows(folder)
        if there and not resume:
            raise InputError(
                "E-STUDY-019",
                f"{folder} holds results already; go on with its study by --resume, or give another --out.",
            )
        if there:
            _require_same(folder, origin)
        stored = read_study_rows(folder)
        known = set(stored.frame[KEY].to_list())
        _require_rows(plan, folder, known)
        remarks = tuple(f"{what} could not be read; its tasks ran again" for what in stored.damaged)
        run = StudyRun(plan, folder, command, remarks, {**declared, **origin})
        if not there:
            with publishing():
                write_results(folder, run.document(stored.frame))
        waiting = [(number, row) for number, row in enumerate(plan.rows) if row.key not in known]
        _carry_out(plan, waiting, workers, StudyStore(folder, len(known), len(plan.rows)), progress)
        with publishing():
            document = run.finish()
        remove_rows(folder)
    return document


def _carry_out(
    plan: StudyPlan,
    waiting: Sequence[tuple[int, Any]],
    workers: Workers,
    store: StudyStore,
    progress: Progress,
) -> None:
    total, done = len(plan.rows), len(plan.rows) - len(waiting)
    progress(STAGE, done / total)
    for outcome in workers.results(run_row, [row for _, row in waiting], plan.tasks):
        store.add(*waiting[outcome.index], outcome)
        done += 1
        progress(STAGE, done / total)


def _require_same(folder: Path, origin: Mapping[str, str]) -> None:
    """Raise `InputError` where the stored rows come from another program, robot, data or kind of study."""
    if not (folder / RESULTS).is_file():
        raise InputError(
            "E-STUDY-020",
            f"{folder} has rows of a study, but no {RESULTS} that tells of which; give another --out.",
        )
    before = read_results(folder)
    if before["kind"] != "study":
        raise InputError("E-STUDY-021", f"{folder} holds the results of another verb; give another --out.")
    changed = [name for name, value in origin.items() if before["provenance"].get(name) != value]
    if changed:
        raise InputError(
            "E-STUDY-022",
            f"{', '.join(sorted(changed))} changed since the study in {folder} began, so that its rows would not fit together; begin "
            "another with another --out.",
        )


def _require_rows(plan: StudyPlan, folder: Path, known: set[str]) -> None:
    missing = known - {row.key for row in plan.rows}
    if missing:
        raise InputError(
            "E-STUDY-023",
            f"{plan.path} no longer declares {len(missing)} of the {len(known)} tasks that are stored in {folder}; rows may be added to a "
            "study, but not changed or removed: put them back, or give another --out.",
        )


def _varied(plan: StudyPlan) -> list[str]:
    """Columns of the options that differ between rows."""
    values: dict[str, set[Any]] = {}
    for row in plan.rows:
        for name, value in row.options.items():
            values.setdefault(name, set()).add(option_cell(value))
    return [f"{OPTION}{name}" for name, given in values.items() if len(given) > 1]
