"""Motor commands of the calibrated robot for tool targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.fit import KNOWN_POINT_STD, point_uncertainty
from flexcal.compensation import MotorCommands, best_posture, motor_commands
from flexcal.data.poses import ToolTargets, read_targets, write_commands
from flexcal.data.tables import TableFile, open_table
from flexcal.errors import FlexcalError, InputError
from flexcal.jobs.inputs import calibrated_robot, is_station_identified
from flexcal.model.kinematics import found_xyz, joint_limits
from flexcal.model.robot import RobotModel, with_point_at_frame
from flexcal.model.statics import points_kinematics
from flexcal.progress import Progress, silent
from flexcal.units import MILLIMETRE

_FAR = 0.25
"""Of the reach: points that are farther than this from the joint positions beside them do not belong to them."""


@dataclass(frozen=True, eq=False)
class Compensation:
    """The commands for the `targets` of a `file`; `start` (n,): where inverse kinematics started, None with joint positions.

    `nominal` is the uncalibrated robot with the `measured` points where they were found.
    """

    model: RobotModel
    file: TableFile
    targets: ToolTargets
    result: MotorCommands
    start: np.ndarray | None
    nominal: RobotModel
    measured: tuple[str, ...]

    @property
    def refused(self) -> list[dict[str, Any]]:
        """Number of the pose, line or row of the file, and reason of every target without a command."""
        return [
            {
                "pose": int(self.targets.pose[k]),
                self.file.row_word: int(self.file.first + k),
                "reason": str(self.result.reason[k]),
            }
            for k in np.flatnonzero(~self.result.reached)
        ]

    @property
    def points(self) -> dict[str, dict[str, Any]]:
        """The points that are brought to the targets: frame, and place in it (m) as declared and, where measured, as found."""
        named = dict.fromkeys(self.targets.target.tolist())
        return {
            name: {
                "frame": self.model.points[name].frame,
                "declared_xyz_m": self.model.points[name].xyz,
                "found_xyz_m": found_xyz(self.model, name) if name in self.measured else None,
                "std_m": point_uncertainty(self.model, name) if name in self.measured else None,
            }
            for name in named
        }

    @property
    def lost_points(self) -> dict[str, float]:
        """1σ (m) of the measured points whose place on the tool the calibration did not find."""
        every = {name: point_uncertainty(self.model, name) for name in self.measured}
        return {name: std for name, std in every.items() if std > KNOWN_POINT_STD}

    def document(self) -> dict[str, Any]:
        """The JSON document; `error_before_mm` is how far the real tool would be off with the nominal commands."""
        result, reached = self.result, self.result.reached
        before = result.before[reached] / MILLIMETRE
        change = np.abs(result.q - result.nominal)[reached].max(axis=0)
        return {
            "targets": len(self.targets),
            "points": self.points,
            "points_not_found_m": self.lost_points,
            "compensated": int(reached.sum()),
            "ambiguous": int((reached & ~result.unambiguous).sum()),
            "error_before_mm": {
                "mean_mm": float(before.mean()),
                "p90_mm": float(np.quantile(before, 0.9)),
                "max_mm": float(before.max()),
            },
            "largest_change": dict(zip(self.model.joint_names, change.tolist(), strict=True)),
            "start": None
            if self.start is None
            else dict(zip(self.model.joint_names, self.start.tolist(), strict=True)),
            "from_other_postures": self.targets.pose[reached & result.elsewhere].tolist(),
            "refused": self.refused,
        }


def compensate_robot(
    robot: Path,
    file: Path,
    out: Path,
    *,
    estimates: Path | None = None,
    target: str | None = None,
    frame: str | None = None,
    start: Sequence[float] = (),
    progress: Progress = silent,
) -> Compensation:
    """Write the motor commands that bring the calibrated robot's tool to the targets of `file` to `out`, CSV or Parquet.

    The targets are of the point `target` under `points:`, or of the origin of the URDF frame `frame`; by default of what the column
    `target` says, or the first point. Wanted poses are those of the nominal robot with the measured point where it was found, so that
    its ruler's error is not put into the commands.

    A target without a command is left out there, and stands with its reason in the result; the others keep their numbers and order. `start`
    (n values, rad or m; none: a posture far from singular) is where inverse kinematics starts for targets without joint positions.
    Raises `FlexcalError` where there is no calibration, a file does not fit, points are in another frame than said, or no target can be
    compensated: then nothing is written.
    """
    calibrated = calibrated_robot(robot, estimates, "compensate with")
    if target is not None:
        calibrated.nominal.point(target)
        if frame is not None:
            raise InputError("E-RUN-013", "--target and --frame exclude each other; give one of them.")
    model, nominal = (
        robot_ if frame is None else with_point_at_frame(robot_, frame)
        for robot_ in (calibrated.probable, calibrated.with_points)
    )
    targets = _of_point(read_targets(file, model), file, target if frame is None else frame)
    for station in dict.fromkeys([] if targets.station is None else targets.station.tolist()):
        if not is_station_identified(model, station):
            raise InputError(
                "E-RUN-014",
                f"{file}: the station '{station}' was not calibrated, so its position is unknown; give points in the base frame.",
            )
    _check_frame(file, nominal, targets)
    origin = None
    if targets.q is None:
        origin = _start(nominal, start) if len(start) else best_posture(nominal, str(targets.target[0]))
    elif len(start):
        raise InputError(
            "E-RUN-015",
            f"{file} has joint positions, which are the start of the inverse kinematics; leave --start out.",
        )
    result = motor_commands(model, nominal, targets, start=origin, progress=progress)
    if not result.reached.any():
        raise FlexcalError(
            "E-RUN-016",
            f"{file}: none of the {len(targets)} targets can be compensated; pose {targets.pose[0]}: {result.reason[0]}.",
        )
    reached = targets.subset(result.reached)
    commands = ToolTargets(reached.pose, reached.target, result.q[result.reached], payload=reached.payload)
    table = open_table(file)
    write_commands(out, model, commands, result.unambiguous[result.reached], table)
    return Compensation(model, table, targets, result, origin, nominal, calibrated.measured)


def _of_point(targets: ToolTargets, file: Path, name: str | None) -> ToolTargets:
    """The targets as those of the point `name`, where one is given."""
    if name is None:
        return targets
    if "target" in open_table(file).columns:
        raise InputError("E-RUN-017", f"{file} has a column 'target'; leave --target and --frame out.")
    return replace(targets, target=np.full(len(targets), name))


def _check_frame(file: Path, nominal: RobotModel, targets: ToolTargets) -> None:
    """Raise `InputError` where points said to be in the base frame are far from where the joint positions beside them put the tool."""
    if targets.q is None or targets.position is None or targets.station is not None:
        return
    at = points_kinematics(nominal, targets.q, None, targets.target, jacobians=False).position
    away = float(np.median(np.linalg.norm(targets.position - at, axis=1)))
    if away > _FAR * nominal.reach:
        raise InputError(
            "E-RUN-018",
            f"{file}: x, y, z are {away:.3g} m (median) from where the nominal tool is at q1…q{nominal.n}; if they are in an instrument's "
            "frame, name its station in a column 'station', else correct one of them or leave q out.",
        )


def _start(model: RobotModel, values: Sequence[float]) -> np.ndarray:
    start, (lower, upper) = np.array(values, dtype=float), joint_limits(model)
    if len(start) != model.n:
        raise InputError(
            "E-RUN-019",
            f"--start has {len(start)} values, but {model.name} has {model.n} joints; give one each.",
        )
    outside = np.flatnonzero((start < lower) | (start > upper) | ~np.isfinite(start))
    if len(outside):
        j = int(outside[0])
        raise InputError(
            "E-RUN-020",
            f"--start puts {model.joint_names[j]} at {start[j]:g}, outside its limits ({lower[j]:.4g} to {upper[j]:.4g}); use rad.",
        )
    return start
