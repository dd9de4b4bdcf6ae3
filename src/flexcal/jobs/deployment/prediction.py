"""Predicted tool poses of the calibrated robot for motor commands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.data.poses import ToolTargets, read_commands, write_targets
from flexcal.errors import FlexcalError
from flexcal.jobs.inputs import (
    CalibratedRobot,
    beyond_calibration,
    beyond_remark,
    use_remarks,
    with_temperature,
)
from flexcal.jobs.pages import Result
from flexcal.model.robot import RobotModel
from flexcal.model.statics import are_flanks_certain, carried_mass, points_kinematics, tool_at_rest
from flexcal.progress import Progress, silent

_BLOCK = 20_000
"""Number of commands whose tool poses are computed together."""


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Result):
    """Result of `predict`: poses of the real tool.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot.
    tool : ToolTargets
        Positions and orientations of the tool in the base frame.
    beside : ndarray
        Distance (N, 3), m, of these positions from those of the nominal robot.
    unambiguous : ndarray
        Whether (N,) the flank of every backlash is certain.
    remarks : tuple of str
        What makes the positions doubtful.
    """

    tool: ToolTargets
    beside: np.ndarray
    unambiguous: np.ndarray
    remarks: tuple[str, ...] = ()

    @property
    def headline(self) -> str:
        """Distance from the nominal robot's tool."""
        return f"{len(self.tool)} poses, beside the nominal robot's: {ErrorStatistics.of(self.beside)}"

    def summary(self) -> str:
        """Distance from the nominal robot's tool, and poses whose flank is uncertain."""
        ambiguous = int((~self.unambiguous).sum())
        flanks = (f"flank of a backlash uncertain in {ambiguous} poses",) if ambiguous else ()
        return "\n".join([self.headline, *flanks, *self.remarks])

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "poses": len(self.tool),
            "beside_nominal": ErrorStatistics.of(self.beside).in_millimetres(),
            "ambiguous_poses": self.tool.pose[~self.unambiguous].tolist(),
            "remarks": list(self.remarks),
        }


def predict(
    robot: CalibratedRobot,
    commands: ToolTargets,
    *,
    temperature: float | None = None,
    progress: Progress = silent,
) -> Prediction:
    """Predict the pose of the real tool for motor commands: geometry, deflection under gravity and payload, backlash, and
    hysteresis where it is said from which side the joints come.

    Parameters
    ----------
    robot : CalibratedRobot
        `Calibration.robot`, or ``CalibratedRobot.from_yaml(path)``.
    commands : ToolTargets
        Commanded joint positions `q` (N, n), rad or m, the names of the points (N,) that are looked at, and payloads (N,), kg, where
        they are not as declared, temperatures (N,), °C, and the sides (N, n) from which the joints come.
    temperature : float, optional
        Temperature of the arm, °C, for commands that have none; by default that at which the calibrated parameters hold.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    Prediction
        `tool.position` (N, 3), m, and `tool.rotation` (N, 3, 3) in the base frame, and `beside`, the distances from the nominal robot's.

    Raises
    ------
    FlexcalError
        For targets without joint positions.

    Examples
    --------
    >>> import numpy as np
    >>> from flexcal import RobotModel, ToolTargets, calibrate, predict, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> robot = calibrate(model, poses, terms=["kinematic"]).robot
    >>> q = np.array([[0.3, -1.2, 1.5, 0.0, 1.6, 0.0]])
    >>> commands = ToolTargets(pose=np.array([1]), target=np.array(["smr"]), q=q)
    >>> predict(robot, commands).tool.position.round(2)
    array([[0.55, 0.28, 0.24]])
    """
    if commands.q is None:
        raise FlexcalError("E-RUN-097", "the commands hold no joint positions q; give those of the motors.")
    far = beyond_calibration(robot, commands.q, commands.target)
    commands, warm = with_temperature(robot, commands, temperature)
    parts = []
    for first in range(0, len(commands), _BLOCK):
        progress("predicting", first / len(commands))
        block = commands.subset(slice(first, first + _BLOCK))
        parts.append(_predicted(robot.probable, robot.with_points, block))
    progress("predicting", 1.0)
    position, rotation, beside, certain = (np.concatenate(part) for part in zip(*parts, strict=True))
    tool = replace(commands, q=None, position=position, rotation=rotation)
    return Prediction(
        robot.probable,
        tool,
        beside,
        certain,
        (*use_remarks(robot), *warm, *beyond_remark(robot, far, "poses")),
    )


def predict_robot(
    robot_file: Path,
    file: Path,
    out: Path,
    *,
    estimates: Path | None = None,
    temperature: float | None = None,
    progress: Progress = silent,
) -> Prediction:
    """`predict` for the commands of `file`; the tool's poses go to `out`, CSV or Parquet.

    Raises `FlexcalError` where there is no calibration or a file does not fit; then nothing is written.
    """
    robot = CalibratedRobot.from_yaml(robot_file, estimates)
    progress("reading", 0.0)
    commands = read_commands(file, robot.probable)
    progress("reading", 1.0)
    prediction = predict(robot, commands, temperature=temperature, progress=progress)
    write_targets(out, prediction.tool)
    return prediction


def _predicted(
    model: RobotModel, nominal: RobotModel, commands: ToolTargets
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions (N, 3), orientations (N, 3, 3), deviations from the nominal positions (N, 3), and mask of certain flanks (N,)."""
    assert commands.q is not None
    at = tool_at_rest(
        model,
        commands.q,
        commands.payload,
        commands.target,
        temperature=commands.temperature,
        approach=commands.approach,
    )
    there = points_kinematics(nominal, commands.q, None, commands.target, jacobians=False).position
    payload = carried_mass(model, commands.payload, len(commands))
    certain = are_flanks_certain(model, commands.q, at.rest.torque, payload)
    position = at.kinematics.position
    return position, at.kinematics.orientation, position - there, certain
