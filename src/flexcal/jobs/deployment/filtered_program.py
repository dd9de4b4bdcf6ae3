"""Result of the correction of a program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.jobs.deployment.controller_poses import ControllerPoses
from flexcal.jobs.deployment.program_files import write_program
from flexcal.jobs.pages import PlottedResult
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord
from flexcal.model.parts import rotation_vector
from flexcal.programs import NewNumbers, Program, ProgramFile, ProgramTarget
from flexcal.report.layout import Page
from flexcal.report.pages import ProgramStudy, program_page
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False)
class ToolPoses:
    """Positions (N, 3), m, and rotations (N, 3, 3) of the tool in the robot's root frame; NaN where there is none."""

    position: np.ndarray
    rotation: np.ndarray

    @classmethod
    def of(cls, places: ControllerPoses, targets: Sequence[ProgramTarget], q: np.ndarray) -> ToolPoses:
        """Tool of the nominal robot at joint positions (N, 6); of targets whose tool is not known, the flange."""
        position, rotation = np.full((len(q), 3), np.nan), np.full((len(q), 3, 3), np.nan)
        known = np.flatnonzero(np.isfinite(q).all(axis=1))
        if len(known):
            position[known], rotation[known] = places.poses(q[known])
        for k in known.tolist():
            if (tool := targets[k].tool or places.tool) is not None:
                position[k] += rotation[k] @ tool.position
                rotation[k] = rotation[k] @ tool.rotation
        return cls(position, rotation)


@dataclass(frozen=True, eq=False, repr=False)
class FilteredProgram(PlottedResult):
    """Result of `filter_program`.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot.
    program : Program
        The program that was read.
    new : dict
        Numbers in the new program by index of target, in the program's units; targets that stay as they are have none.
    between : dict
        Numbers of points that are inserted on the way to targets, by the index of the move in `program.moves`.
    missed : ndarray
        Largest distance (N,), m, on the line or arc to a target between the needed correction and the interpolation of the corrected ends,
        before points are inserted; NaN where there is none, or it is not known.
    commands : ndarray
        Joint positions (N, 6) of the URDF at the new numbers, rad or m; NaN where a target stays.
    nominal, corrected : ToolPoses
        Where the nominal robot has the tool at the old and at the new numbers.
    reasons : tuple of str
        Why a target stays as it is; empty where it does not.
    remarks : tuple of str
        What makes the new numbers doubtful.
    reversed : bool
        Whether the new numbers are those for the nominal robot.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    program: Program
    new: dict[int, NewNumbers]
    between: dict[int, list[NewNumbers]]
    missed: np.ndarray
    commands: np.ndarray
    nominal: ToolPoses
    corrected: ToolPoses
    reasons: tuple[str, ...]
    remarks: tuple[str, ...]
    reversed: bool = False
    record: RunRecord = NOT_RECORDED

    @property
    def shift(self) -> np.ndarray:
        """Distance (N,), m, by which the tool of the nominal robot moves from the old to the new numbers; NaN where a target stays."""
        return np.linalg.norm(self.corrected.position - self.nominal.position, axis=1)

    @property
    def turn(self) -> np.ndarray:
        """Angle (N,), rad, by which it turns."""
        done = np.isfinite(self.shift)
        angle = np.full(len(done), np.nan)
        turned = self.corrected.rotation[done] @ np.swapaxes(self.nominal.rotation[done], 1, 2)
        angle[done] = np.linalg.norm(rotation_vector(turned), axis=1)
        return angle

    @property
    def files(self) -> tuple[ProgramFile, ...]:
        """Files of the new program."""
        return self.program.rewritten(self.new, self.between)

    @property
    def headline(self) -> str:
        """Number of targets that were corrected, and by how much."""
        done = np.isfinite(self.shift)
        if not len(done):
            return "no motion of the program has a target that is written as numbers"
        if not done.any():
            return f"none of {len(self.reasons)} targets corrected"
        shift = self.shift[done] / MILLIMETRE
        left = len(self.program.computed) + int((~done).sum())
        return (
            f"{int(done.sum())} targets corrected by {shift.mean():.3f} mm on average, {shift.max():.3f} mm at most; "
            f"{left} motions left as they are"
        )

    def write(self, out: str | Path) -> list[Path]:
        """Write the new program, every other byte as before.

        Parameters
        ----------
        out : str or Path
            File for a program of one file, folder for one of several, which keep their names.

        Returns
        -------
        list of Path
            The files.

        Raises
        ------
        InputError
            Where `out` does not fit, or would replace the original.
        """
        return write_program(self.files, Path(out))

    def _page(self) -> Page:
        done = np.flatnonzero(np.isfinite(self.shift))
        first = self.commands[done[0]] if len(done) else None
        return program_page(ProgramStudy(self.model, self.document(), first))

    def summary(self) -> str:
        """Number of corrected targets, those left with their reasons, and remarks."""
        left = [f"line {item['line']}: {item['text']}: {item['reason']}" for item in self.left]
        return "\n".join([self.headline, *left, *self.remarks])

    @property
    def left(self) -> list[dict[str, Any]]:
        """Line, text and reason of every target that stays as it is."""
        name = {k: file.name for k, file in enumerate(self.program.files)}
        own = [
            {
                "order": k,
                "file": name[target.file],
                "line": target.line,
                "text": target.name,
                "reason": self.reasons[k],
            }
            for k, target in enumerate(self.program.targets)
            if self.reasons[k]
        ]
        corrected = {self.program.targets[k].variable.lower() for k in self.new}
        found = [
            {
                "order": None,
                "file": name[item.file],
                "line": item.line,
                "text": item.text,
                "reason": item.reason_beside(corrected),
            }
            for item in self.program.computed
        ]
        return sorted([*own, *found], key=lambda item: (item["file"], item["line"]))

    def document(self) -> dict[str, Any]:
        """JSON document: every target with its numbers before and after, and what stays as it is."""
        shift, turn = self.shift, self.turn
        corrected = [
            {
                "order": k,
                "file": self.program.files[target.file].name,
                "line": target.line,
                "name": target.name,
                "motion": target.motion,
                "kind": "joints" if target.joints else "pose",
                "before": list(target.values),
                "after": list(self.new[k].values),
                "configuration": list(self.new[k].words),
                "nominal_xyz_m": self.nominal.position[k].tolist(),
                "corrected_xyz_m": self.corrected.position[k].tolist(),
                "shift_mm": float(shift[k] / MILLIMETRE),
                "turn_deg": float(np.rad2deg(turn[k])),
                "between_mm": float(self.missed[k] / MILLIMETRE) if np.isfinite(self.missed[k]) else None,
                "inserted": sum(
                    len(points) for m, points in self.between.items() if self.program.moves[m].end == k
                ),
            }
            for k, target in enumerate(self.program.targets)
            if k in self.new
        ]
        return {
            "program": [file.name for file in self.program.files],
            "dialect": self.program.dialect.name,
            "units": self.program.dialect.notation.units,
            "reversed": self.reversed,
            "targets": corrected,
            "left": self.left,
            "remarks": list(self.remarks),
            **self.record.document(),
        }
