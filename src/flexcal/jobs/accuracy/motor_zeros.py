"""Zeros of a calibrated robot in LeRobot's calibration of its motors, and whether zeros are enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.calibration.verification import best_placement, can_register_with_points
from flexcal.data.poses import PoseSet, read_poses
from flexcal.errors import FlexcalError, InputError
from flexcal.export import (
    TICKS,
    JointMotor,
    MotorCalibration,
    corrected_file,
    joint_motors,
    measure_export_error,
    read_motor_calibrations,
    render_offsets,
)
from flexcal.files.transaction import write_text
from flexcal.jobs.calibration import fitted_files, fitted_points
from flexcal.jobs.deployment import identified_robot, poses_where_it_holds, undetermined_zeros
from flexcal.jobs.inputs import CalibratedRobot
from flexcal.jobs.pages import Result
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest
from flexcal.printable import quoted
from flexcal.units import DEGREE, MILLIMETRE

_SAME = 0.02
"""Relative difference of mean errors that does not matter."""
_MOST = 0.9
"""Share of the improvement by geometry from which zeros alone are enough."""
_LITTLE = 0.9
"""Share of the error without correction above which a correction is worth nothing."""


@dataclass(frozen=True, eq=False)
class ZerosVerdict:
    """Errors (N,), m, of the uncorrected robot, of one with corrected zeros and of the calibrated one at measured poses.

    Each robot is best-fit registered with the poses, which are outside of the calibration.
    """

    without: np.ndarray
    zeros: np.ndarray
    geometry: np.ndarray

    @property
    def answer(self) -> Literal["zeros", "geometry", "neither"]:
        """Zeros where they leave no more than geometry does, by a standard error of the paired difference or 2 %, or bring nine tenths of
        what geometry brings.

        Neither where the better of them leaves more than nine tenths of the error without correction.
        """
        more = self.zeros - self.geometry
        if min(self.zeros.mean(), self.geometry.mean()) > _LITTLE * self.without.mean():
            return "neither"
        error = more.std(ddof=1) / np.sqrt(len(more))
        alike = more.mean() <= max(error, _SAME * self.zeros.mean())
        return "zeros" if alike or (self.recovered or 0.0) >= _MOST else "geometry"

    @property
    def recovered(self) -> float | None:
        """Share of the improvement by the whole geometry that the zeros alone bring; None where geometry improves nothing."""
        gain = self.without.mean() - self.geometry.mean()
        return float((self.without.mean() - self.zeros.mean()) / gain) if gain > 0 else None

    @property
    def sentence(self) -> str:
        """The answer, with its numbers."""
        left, zeros, geometry = (
            f"{errors.mean() / MILLIMETRE:.2f} mm" for errors in (self.without, self.zeros, self.geometry)
        )
        said = (
            f"zeros or geometry: mean errors at {len(self.zeros)} measured poses are {left} uncorrected, {zeros} with corrected zeros and "
            f"{geometry} with the whole geometry"
        )
        if self.answer == "neither":
            return (
                f"{said}: neither helps much here; look at play, and at the order and the signs of the joints"
            )
        share = (
            "" if self.recovered is None else f"zeros bring {100 * self.recovered:.0f} % of the improvement; "
        )
        if self.answer == "zeros":
            return f"{said}: {share}LeRobot's file holds them"
        return (
            f"{said}: {share}LeRobot's file cannot hold the rest, a URDF can: 'flexcal export urdf' or 'xacro', in place of this file and "
            "not beside it"
        )

    def document(self) -> dict[str, Any]:
        """Entry of the JSON document."""
        named = (("without", self.without), ("zeros", self.zeros), ("geometry", self.geometry))
        return {
            "answer": self.answer,
            "recovered": self.recovered,
            "poses": len(self.zeros),
            **{
                name: {
                    "mean_mm": errors.mean() / MILLIMETRE,
                    "rms_mm": float(np.sqrt((errors**2).mean())) / MILLIMETRE,
                    "max_mm": errors.max() / MILLIMETRE,
                }
                for name, errors in named
            },
        }


@dataclass(frozen=True, eq=False, repr=False)
class MotorZeros(Result):
    """Result of `export_motor_zeros`.

    `motors` are those of the joints as before, and `corrected` after; `offsets` (rad) is what this adds to the joints' positions, and
    `determined` which of them the measurements tell. `modelled` are mean errors, m, without and with corrected zeros by the calibration's
    own account.
    """

    path: Path
    motors: tuple[JointMotor, ...]
    corrected: tuple[MotorCalibration, ...]
    offsets: tuple[float, ...]
    determined: tuple[bool, ...]
    modelled: tuple[float, float]
    verdict: ZerosVerdict | None
    remarks: tuple[str, ...]

    @property
    def headline(self) -> str:
        """The verdict, or what the calibration itself tells of zeros."""
        if self.verdict is not None:
            return self.verdict.sentence
        without, zeros = (f"{value / MILLIMETRE:.2f} mm" for value in self.modelled)
        return (
            f"zeros or geometry: by the calibration's own account zeros alone leave {zeros} of {without} on average; whether that is so, "
            "measured poses outside the calibration tell: --verification POSES"
        )

    def summary(self) -> str:
        """The verdict and remarks."""
        return "\n".join([self.headline, *self.remarks])

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "file": self.path,
            "joints": {
                motor.joint: {
                    "motor": motor.motor.name,
                    "offset_deg": offset / DEGREE,
                    "determined": told,
                    "range_before": [motor.motor.range_min, motor.motor.range_max],
                    "range": [new.range_min, new.range_max],
                }
                for motor, new, offset, told in zip(
                    self.motors, self.corrected, self.offsets, self.determined, strict=True
                )
            },
            "by_the_model_mm": dict(
                zip(("without", "zeros"), (v / MILLIMETRE for v in self.modelled), strict=True)
            ),
            "zeros_or_geometry": None if self.verdict is None else self.verdict.document(),
            "remarks": list(self.remarks),
        }


def export_motor_zeros(
    robot_file: Path,
    calibration: Path,
    out: Path,
    *,
    motors: Sequence[str] = (),
    verification: Sequence[Path] = (),
    estimates: Path | None = None,
) -> MotorZeros:
    """Write LeRobot's calibration of the motors with the best joint zeros of a calibrated robot, and compare zeros with geometry.

    Parameters
    ----------
    robot_file : Path
        robot.yaml.
    calibration : Path
        LeRobot's file, with which the poses of the calibration were recorded.
    out : Path
        File to write: ranges about other middles, everything else as in `calibration`.
    motors : sequence of str
        Motors of joints with other names, as `joint_motors` takes them.
    verification : sequence of Path
        Files of measured poses outside the calibration.
    estimates : Path, optional
        estimates.yaml or its folder, in place of that beside robot.yaml.

    Returns
    -------
    MotorZeros
        Offsets, new ranges, and the verdict.

    Raises
    ------
    InputError
        For files that cannot be read or used, joints without a motor, a robot without a calibration, and too few poses.
    """
    robot = identified_robot(robot_file, estimates)
    if "calibration" not in robot.blocks:
        raise InputError(
            "E-ROS-027",
            f"{robot_file}: there is no calibration, so no zeros to write; run 'flexcal calibrate {quoted(robot_file)} POSES…' first.",
        )
    robot.nominal.require_motors("LeRobot's calibration")
    sliding = next((joint.name for joint in robot.nominal.joints if joint.kind == "prismatic"), None)
    if sliding is not None:
        raise FlexcalError(
            "E-ROS-028", f"'{sliding}' slides, but motors of LeRobot turn joints; use 'export offsets'."
        )
    own = joint_motors(calibration, read_motor_calibrations(calibration), robot.nominal.joint_names, motors)
    seen = _unseen(robot, tuple(verification))
    model = robot.probable
    draw = poses_where_it_holds(robot, model, near=False)
    rendered = render_offsets(model, robot.nominal, undetermined=undetermined_zeros(robot), draw=draw)
    table, names = rendered.table["joints"], robot.nominal.joint_names
    determined = tuple(name in table and table[name]["determined"] for name in names)
    new = [
        motor.corrected(table[name]["offset"] if name in table else 0.0)
        for motor, name in zip(own, names, strict=True)
    ]
    offsets = tuple(motor.offset_to(after) for motor, after in zip(own, new, strict=True))
    corrected = robot.nominal.with_values({f"{n}.offset": v for n, v in zip(names, offsets, strict=True)})
    changed = [motor for motor, old in zip(new, own, strict=True) if motor != old.motor]
    assert rendered.tool is not None
    left = measure_export_error(model, rendered.tool, (), point=rendered.point, draw=draw).error
    assert left is not None
    modelled = (rendered.table["without_offsets"]["mean_mm"] * MILLIMETRE, left.mean)
    verdict = None if seen is None else _verdict((robot.nominal, corrected, model), seen)
    write_text(out, corrected_file(calibration, changed))
    return MotorZeros(
        model, out, own, tuple(new), offsets, determined, modelled, verdict, _remarks(own, new, determined)
    )


def _unseen(robot: CalibratedRobot, files: tuple[Path, ...]) -> PoseSet | None:
    """Measured poses outside the calibration; None without files."""
    if not files:
        return None
    seen = read_poses(files, robot.nominal)
    known = fitted_files(robot, files) or fitted_points(robot, seen)
    if known:
        raise InputError(
            "E-ROS-030",
            f"the calibration was made from {' and '.join(known)}; give poses outside of it under --verification, or leave it out.",
        )
    if not seen.located.all() or not can_register_with_points(seen):
        raise InputError(
            "E-ROS-029",
            f"{files[0]}: zeros and geometry are compared at measured points x, y, z, at 12 poses at least; measure more.",
        )
    return seen


def _verdict(robots: Sequence[RobotModel], seen: PoseSet) -> ZerosVerdict:
    """Errors of the nominal robot, of one with corrected zeros and of the calibrated one at measured poses."""
    errors = []
    for each in robots:
        at = tool_at_rest(each, seen.q, seen.payload, seen.target).kinematics
        placed = best_placement(seen, at.position, at.orientation)
        left = seen.position - placed.expected(seen, at.position, at.orientation)
        errors.append(np.linalg.norm(left, axis=1))
    return ZerosVerdict(*errors)


def _remarks(
    own: Sequence[JointMotor], new: Sequence[MotorCalibration], determined: Sequence[bool]
) -> tuple[str, ...]:
    """What the user must know of the file."""
    remarks = []
    open_ = [motor.joint for motor, told in zip(own, determined, strict=True) if not told]
    if open_:
        remarks.append(
            f"not determined, and as before: {', '.join(open_)}; what was measured cannot tell their zeros from another place of the base "
            "or of the measured point on the tool"
        )
    cut = [
        f"{motor.joint} by {360 / TICKS * (_range(motor.motor) - _range(after)):.0f}°"
        for motor, after in zip(own, new, strict=True)
        if 360 / TICKS * (_range(motor.motor) - _range(after)) >= 1
    ]
    if cut:
        remarks.append(
            f"LeRobot's zero is the middle of a range, so ranges are shorter: {', '.join(cut)}; policies and recordings in percent of the "
            "range, made before, do not fit the new file"
        )
    if any(motor.motor.drive_mode for motor in own):
        remarks.append(
            "drive_mode reverses percent of the range, not degrees; --motors JOINT=-MOTOR says the sign of the joint"
        )
    return tuple(remarks)


def _range(motor: MotorCalibration) -> int:
    return motor.range_max - motor.range_min
