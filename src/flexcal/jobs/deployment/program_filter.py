"""Programs whose targets are replaced by those that bring the real tool there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.compensation import ToolPoseTarget, motor_commands, nominal_joint_positions
from flexcal.data.poses import ToolTargets
from flexcal.errors import FlexcalError, InputError
from flexcal.files.transaction import atomic_path
from flexcal.jobs.deployment.controller_poses import ControllerPoses
from flexcal.jobs.inputs import CalibratedRobot, unmeasured_lengths_remark
from flexcal.jobs.pages import Result
from flexcal.model.parts import rotation_vector
from flexcal.model.robot import RobotModel, with_point_at_frame
from flexcal.model.statics import tool_at_rest
from flexcal.programs import Program, parse_urscript
from flexcal.units import MILLIMETRE

_FLANGE = "tool0"
"""Frame of a Universal Robots' URDF in which the controller gives tools."""
_SUFFIXES = (".script", ".urscript")


@dataclass(frozen=True, eq=False, repr=False)
class FilteredProgram(Result):
    """Result of `filter_program`.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot.
    program : Program
        The program that was read.
    values : ndarray
        Numbers (N, 6) of the targets in the new program, m and rad; NaN where a target stays as it is.
    shift : ndarray
        Distance (N,), m, between the flange of the nominal robot at the new and at the old numbers.
    turn : ndarray
        Angle (N,), rad, between these two.
    reasons : tuple of str
        Why a target stays as it is; empty where it does not.
    remarks : tuple of str
        What makes the new numbers doubtful.
    """

    program: Program
    values: np.ndarray
    shift: np.ndarray
    turn: np.ndarray
    reasons: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def text(self) -> str:
        """The new program."""
        changed = [k for k, reason in enumerate(self.reasons) if not reason]
        return self.program.rewritten({k: self.values[k].tolist() for k in changed})

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

    def summary(self) -> str:
        """Number of corrected targets, those left with their reasons, and remarks."""
        left = [f"line {item['line']}: {item['text']}: {item['reason']}" for item in self.left]
        return "\n".join([self.headline, *left, *self.remarks])

    @property
    def left(self) -> list[dict[str, Any]]:
        """Line, text and reason of every target that stays as it is."""
        own = [
            {"line": target.line, "text": target.name, "reason": reason}
            for target, reason in zip(self.program.targets, self.reasons, strict=True)
            if reason
        ]
        found = [
            {"line": item.line, "text": item.text, "reason": item.reason} for item in self.program.computed
        ]
        return sorted([*own, *found], key=lambda item: item["line"])

    def document(self) -> dict[str, Any]:
        """JSON document: every target with its numbers before and after, and what stays as it is."""
        corrected = [
            {
                "line": target.line,
                "name": target.name,
                "motion": target.motion,
                "kind": "joints" if target.joints else "pose",
                "before": list(target.values),
                "after": self.values[k].tolist(),
                "shift_mm": float(self.shift[k] / MILLIMETRE),
                "turn_deg": float(np.rad2deg(self.turn[k])),
            }
            for k, target in enumerate(self.program.targets)
            if not self.reasons[k]
        ]
        return {"targets": corrected, "left": self.left, "remarks": list(self.remarks)}


def filter_program(
    robot: CalibratedRobot,
    program: Program,
    *,
    tool: Sequence[float] = (),
    start: Sequence[float] = (),
    flange: str = _FLANGE,
    reverse: bool = False,
) -> FilteredProgram:
    """Replace the targets of a program by those with which the real robot's flange takes the poses that the nominal robot would take.

    Joint positions become compensated commands. A pose becomes the one at which the controller, whose kinematics are taken to be those of
    the URDF, computes the compensated command. The arm has the configuration of the joint positions beside the pose, else that in which it
    arrives from the target before it in the text.

    Parameters
    ----------
    robot : CalibratedRobot
        The robot, with six joints.
    program : Program
        Its program.
    tool : sequence of float
        Tool centre point in the flange, m and rotation vector in rad (6,), for poses before which the program sets none.
    start : sequence of float
        Joint positions (6,), rad, whose configuration the poses have before which there are none.
    flange : str
        URDF frame of the flange.
    reverse : bool
        Whether to return from corrected targets to the nominal ones.

    Returns
    -------
    FilteredProgram
        `text` is the new program.

    Raises
    ------
    FlexcalError
        For a robot without six joints, and a frame that the URDF lacks.
    """
    model, nominal = (with_point_at_frame(each, flange) for each in (robot.probable, robot.with_points))
    if model.n != 6:
        raise FlexcalError(
            "E-PROG-002",
            f"{model.name} has {model.n} joints, but targets of these programs have six numbers; use the robot.yaml of the six-joint arm.",
        )
    for name, values in (("tool", tool), ("start", start)):
        if len(values) not in (0, 6):
            raise InputError("E-PROG-003", f"--{name} has {len(values)} values; give six.")
    places = ControllerPoses(nominal, flange, tuple(tool), tuple(start))
    q, reasons = places.joints(program.targets)
    values, after = np.full((len(q), 6), np.nan), np.full((len(q), 6), np.nan)
    rows = np.array([k for k, reason in enumerate(reasons) if not reason], dtype=int)
    if len(rows):
        masses, payload_remarks = _payloads(model, program, rows)
        targets = ToolTargets(rows, np.full(len(rows), flange), q[rows], payload=masses)
        after[rows], failures = (_nominal if reverse else _commands)(model, nominal, targets)
        for row, failure in zip(rows.tolist(), failures, strict=True):
            reasons[row] = failure
        done = np.array([k for k in rows if not reasons[k]], dtype=int)
        values[done] = places.values([program.targets[k] for k in done], after[done])
    else:
        done, payload_remarks = rows, ()
    shift, turn = np.full(len(q), np.nan), np.full(len(q), np.nan)
    if len(done):
        (there, turned), (here, was) = places.poses(after[done]), places.poses(q[done])
        shift[done] = np.linalg.norm(there - here, axis=1)
        turn[done] = np.linalg.norm(rotation_vector(turned @ np.swapaxes(was, 1, 2)), axis=1)
    remarks = (*unmeasured_lengths_remark(robot), *program.remarks, *payload_remarks)
    return FilteredProgram(model, program, values, shift, turn, tuple(reasons), remarks)


def filter_program_file(
    robot_file: Path,
    file: Path,
    out: Path | None,
    *,
    estimates: Path | None = None,
    tool: Sequence[float] = (),
    start: Sequence[float] = (),
    flange: str = _FLANGE,
    reverse: bool = False,
) -> FilteredProgram:
    """`filter_program` for a file; the new program goes to `out`, byte for byte as before but for the numbers, or nowhere (None)."""
    if file.suffix.lower() not in _SUFFIXES:
        raise InputError(
            "E-PROG-004",
            f"{file} is no URScript program ({' or '.join(_SUFFIXES)}); other dialects cannot be read.",
        )
    robot = CalibratedRobot.from_yaml(robot_file, estimates)
    if not file.is_file():
        raise InputError("E-PROG-005", f"{file} does not exist; name the program's file.")
    written = file.read_bytes()
    try:
        encoding, text = "utf-8", written.decode("utf-8")
    except UnicodeDecodeError:
        # every byte stands for a character there, and comes back as it was
        encoding, text = "latin-1", written.decode("latin-1")
    program = parse_urscript(text, str(file))
    result = filter_program(robot, program, tool=tool, start=start, flange=flange, reverse=reverse)
    if out is not None:
        with atomic_path(out) as temporary:
            temporary.write_bytes(result.text.encode(encoding))
    return result


def _payloads(
    model: RobotModel, program: Program, rows: np.ndarray
) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Masses (N,), kg, that the arm carries at the targets; None where robot.yaml knows of no payload."""
    said = [program.targets[k].payload for k in rows]
    if model.payload is None:
        if any(said):
            return None, (
                f"the program sets payloads of up to {max(mass or 0.0 for mass in said):g} kg, but robot.yaml declares none, so that the "
                "deflection under them is not corrected: add `payload:`",
            )
        return None, ()
    return np.array([model.payload.mass if mass is None else mass for mass in said]), ()


def _commands(model: RobotModel, nominal: RobotModel, targets: ToolTargets) -> tuple[np.ndarray, list[str]]:
    """Compensated commands (N, 6) and why one has none."""
    commands = motor_commands(model, nominal, targets)
    return commands.q, [str(reason) for reason in commands.reason]


def _nominal(model: RobotModel, nominal: RobotModel, targets: ToolTargets) -> tuple[np.ndarray, list[str]]:
    """Joint positions (N, 6) at which the nominal robot stands as the real one does at its commands, and why there are none."""
    assert targets.q is not None
    at = tool_at_rest(model, targets.q, targets.payload, targets.target).kinematics
    aim = ToolPoseTarget(targets.target, at.position, at.orientation)
    return nominal_joint_positions(nominal, aim, targets.q)
