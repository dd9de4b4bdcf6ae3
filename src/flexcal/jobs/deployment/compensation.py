"""Motor commands of the calibrated robot for tool targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.fit import KNOWN_POINT_STD, point_uncertainty
from flexcal.compensation import MotorCommands, best_posture, motor_commands
from flexcal.data.poses import ToolTargets, read_targets, write_commands
from flexcal.data.tables import TableFile, open_table
from flexcal.errors import FlexcalError, InputError, naming
from flexcal.jobs.inputs import (
    CalibratedRobot,
    beyond_calibration,
    beyond_remark,
    is_station_identified,
    use_remarks,
    with_temperature,
)
from flexcal.jobs.pages import Result
from flexcal.model.kinematics import found_xyz, joint_limits
from flexcal.model.robot import RobotModel, with_point_at_frame
from flexcal.model.statics import points_kinematics
from flexcal.progress import Progress, silent
from flexcal.units import MILLIMETRE

_FAR = 0.25
"""Distance, relative to the reach, above which points do not belong to the joint positions beside them."""


@dataclass(frozen=True, eq=False, repr=False)
class Compensation(Result):
    """Result of `compensate`: motor commands for targets of the tool.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot.
    targets : ToolTargets
        Where the tool is to be.
    commands : MotorCommands
        Command of every target, or the reason why it has none.
    start : ndarray or None
        Joint positions (n,) where inverse kinematics started; None where the targets have joint positions.
    nominal : RobotModel
        The uncalibrated robot with the `measured` points at their calibrated positions.
    measured : tuple of str
        Points that the calibration measured.
    table : TableFile or None
        File that the targets were read from.
    remarks : tuple of str
        What makes the positions doubtful.
    extrapolated : ndarray
        Predicted errors (N,), m (root mean square), of the targets where they are above three times those at the poses of the calibration,
        else 0.
    """

    targets: ToolTargets
    commands: MotorCommands
    start: np.ndarray | None
    nominal: RobotModel
    measured: tuple[str, ...]
    table: TableFile | None = None
    remarks: tuple[str, ...] = ()
    extrapolated: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def headline(self) -> str:
        """Number of targets with a command, and the tool's error without compensation."""
        before = self.commands.before[self.commands.reached] / MILLIMETRE
        return (
            f"commands for {int(self.commands.reached.sum())} of {len(self.targets)} targets, errors with nominal commands: "
            f"mean {before.mean():.3f}, max {before.max():.3f} mm"
        )

    def summary(self) -> str:
        """Number of targets with a command, and the reasons for the others."""
        return "\n".join(
            [self.headline, *(f"pose {item['pose']}: {item['reason']}" for item in self.refused)]
        )

    @property
    def refused(self) -> list[dict[str, Any]]:
        """Number of the pose, line or row of the file, and reason, of every target without a command."""
        return [
            {
                "pose": int(self.targets.pose[k]),
                **({} if self.table is None else {self.table.row_word: int(self.table.first + k)}),
                "reason": str(self.commands.reason[k]),
            }
            for k in np.flatnonzero(~self.commands.reached)
        ]

    @property
    def points(self) -> dict[str, dict[str, Any]]:
        """Points that are brought to the targets: frame, and position in it (m), declared or, if measured, calibrated."""
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
        """1σ (m) of the measured points whose position on the tool the calibration does not determine."""
        every = {name: point_uncertainty(self.model, name) for name in self.measured}
        return {name: std for name, std in every.items() if std > KNOWN_POINT_STD}

    def document(self) -> dict[str, Any]:
        """JSON document; `error_before_mm` is the error of the real tool with the nominal commands."""
        commands, reached = self.commands, self.commands.reached
        before = commands.before[reached] / MILLIMETRE
        change = np.abs(commands.q - commands.nominal)[reached].max(axis=0)
        return {
            "targets": len(self.targets),
            "points": self.points,
            "points_not_found_m": self.lost_points,
            "compensated": int(reached.sum()),
            "ambiguous": int((reached & ~commands.unambiguous).sum()),
            "error_before_mm": {
                "mean_mm": float(before.mean()),
                "p90_mm": float(np.quantile(before, 0.9)),
                "max_mm": float(before.max()),
            },
            "largest_change": dict(zip(self.model.motor_names, change.tolist(), strict=True)),
            "start": None
            if self.start is None
            else dict(zip(self.model.motor_names, self.start.tolist(), strict=True)),
            "extrapolated": [
                {"pose": int(self.targets.pose[k]), "predicted_mm": float(self.extrapolated[k] / MILLIMETRE)}
                for k in np.flatnonzero(self.extrapolated)
            ],
            "from_other_postures": self.targets.pose[reached & commands.elsewhere].tolist(),
            "refused": self.refused,
            "remarks": list(self.remarks),
        }


def compensate(
    robot: CalibratedRobot,
    targets: ToolTargets,
    *,
    frame: str | None = None,
    start: Sequence[float] = (),
    temperature: float | None = None,
    progress: Progress = silent,
) -> Compensation:
    """Compute the motor commands that bring the tool of a calibrated robot to its targets.

    Geometry, deflection under gravity and payload, and backlash are compensated. The desired poses are those of the nominal robot with the
    measured point where it was found, so that a ruler's error in its position is not put into the commands. A target that cannot be
    reached has no command; the others keep theirs.

    Parameters
    ----------
    robot : CalibratedRobot
        `Calibration.robot`, or ``CalibratedRobot.from_yaml(path)``.
    targets : ToolTargets
        Nominal joint positions (N, n), rad or m; or positions (N, 3), m, with orientations where they matter; or both.
    frame : str, optional
        URDF frame whose origin is brought to the targets, in place of the points that `targets` name.
    start : sequence of float
        Joint positions (n,), rad or m, where inverse kinematics starts for targets without their own; by default a posture far from
        singular.
    temperature : float, optional
        Temperature of the arm, °C, for targets that have none; by default that at which the calibrated parameters hold.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    Compensation
        `commands.q` (N, n), rad or m, with `commands.reached` and `commands.reason`.

    Raises
    ------
    FlexcalError
        Where no target can be reached, for points that are in another frame than said, and for a station that was not calibrated.

    Examples
    --------
    The commands that bring the tool to where the nominal robot would have it at `q`:

    >>> import numpy as np
    >>> from flexcal import RobotModel, ToolTargets, calibrate, compensate, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> robot = calibrate(model, poses, terms=["kinematic"]).robot
    >>> q = np.array([[0.3, -1.2, 1.5, 0.0, 1.6, 0.0]])
    >>> targets = ToolTargets(pose=np.array([1]), target=np.array(["smr"]), q=q)
    >>> compensate(robot, targets).commands.reached
    array([ True])
    """
    model, nominal = robot.probable, robot.with_points
    targets, warm = with_temperature(robot, targets, temperature)
    if frame is not None:
        model, nominal = with_point_at_frame(model, frame), with_point_at_frame(nominal, frame)
        targets = replace(targets, target=np.full(len(targets), frame))
    for station in dict.fromkeys([] if targets.station is None else targets.station.tolist()):
        if not is_station_identified(model, station):
            raise FlexcalError(
                "E-RUN-014",
                f"the station '{station}' was not calibrated, so its position is unknown; give points in the base frame.",
            )
    _check_frame(nominal, targets)
    origin = None
    if targets.q is None:
        origin = _start(nominal, start) if len(start) else best_posture(nominal, str(targets.target[0]))
    elif len(start):
        raise FlexcalError(
            "E-RUN-015",
            "it has joint positions, which are the start of the inverse kinematics; leave --start out.",
        )
    commands = motor_commands(model, nominal, targets, start=origin, progress=progress)
    if not commands.reached.any():
        raise FlexcalError(
            "E-RUN-016",
            f"none of the {len(targets)} targets can be compensated; pose {targets.pose[0]}: {commands.reason[0]}.",
        )
    far = np.zeros(len(targets))
    done = commands.reached
    far[done] = beyond_calibration(robot, commands.q[done], targets.target[done])
    return Compensation(
        model,
        targets,
        commands,
        origin,
        nominal,
        robot.measured,
        remarks=(*use_remarks(robot), *warm, *beyond_remark(robot, far, "targets")),
        extrapolated=far,
    )


def compensate_robot(
    robot_file: Path,
    file: Path,
    out: Path,
    *,
    estimates: Path | None = None,
    target: str | None = None,
    frame: str | None = None,
    start: Sequence[float] = (),
    temperature: float | None = None,
    progress: Progress = silent,
) -> Compensation:
    """`compensate` for the targets of `file`; the commands go to `out`, CSV or Parquet.

    The targets are of the point `target` under `points:`, or of the origin of the URDF frame `frame`; by default of what the column
    `target` says, or the first point. A target without a command is left out there, and stands with its reason in the result. Raises
    `FlexcalError` where there is no calibration, a file does not fit, and as `compensate` does: then nothing is written.
    """
    robot = CalibratedRobot.from_yaml(robot_file, estimates)
    if target is not None:
        robot.nominal.point(target)
        if frame is not None:
            raise InputError("E-RUN-013", "--target and --frame exclude each other; give one of them.")
    table = open_table(file)
    targets = read_targets(file, robot.probable)
    if "target" in table.columns and (target is not None or frame is not None):
        raise InputError("E-RUN-017", f"{file} has a column 'target'; leave --target and --frame out.")
    if target is not None:
        targets = replace(targets, target=np.full(len(targets), target))
    with naming(file):
        result = replace(
            compensate(robot, targets, frame=frame, start=start, temperature=temperature, progress=progress),
            table=table,
        )
    commands = result.commands
    reached = replace(targets, temperature=result.targets.temperature).subset(commands.reached)
    rows = ToolTargets(
        reached.pose,
        reached.target,
        commands.q[commands.reached],
        payload=reached.payload,
        temperature=reached.temperature,
        approach=reached.approach,
    )
    write_commands(out, result.model, rows, commands.unambiguous[commands.reached], table)
    return result


def _check_frame(nominal: RobotModel, targets: ToolTargets) -> None:
    """Raise `FlexcalError` for base-frame points far from the tool at the joint positions beside them."""
    if targets.q is None or targets.position is None or targets.station is not None:
        return
    at = points_kinematics(nominal, targets.q, None, targets.target, jacobians=False).position
    away = float(np.median(np.linalg.norm(targets.position - at, axis=1)))
    if away > _FAR * nominal.reach:
        raise FlexcalError(
            "E-RUN-018",
            f"x, y, z are {away:.3g} m (median) from where the nominal tool is at q1…q{nominal.n}; if they are in an instrument's "
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
            f"--start puts {model.motor_names[j]} at {start[j]:g}, outside its limits ({lower[j]:.4g} to {upper[j]:.4g}); use rad.",
        )
    return start
