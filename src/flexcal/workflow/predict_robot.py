"""Predicted tool poses of the calibrated robot for motor commands."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration import ErrorStatistics
from flexcal.data import ToolTargets, read_commands, write_targets
from flexcal.model import carried_mass, tool_at_rest
from flexcal.model.flank import certain_flank
from flexcal.model.resting_tool import points_kinematics
from flexcal.workflow.calibrated_robot import calibrated_robot


@dataclass(frozen=True, eq=False)
class RobotPrediction:
    """Where the real tool is: `tool` in the base frame, `beside` (N, 3) m away from where the nominal robot has it.

    `unambiguous` (N,): the flank of every backlash is certain there.
    """

    tool: ToolTargets
    beside: np.ndarray
    unambiguous: np.ndarray

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "poses": len(self.tool),
            "beside_nominal": ErrorStatistics.of(self.beside).in_millimetres(),
            "ambiguous_poses": self.tool.pose[~self.unambiguous].tolist(),
        }


def predict_robot(robot: Path, file: Path, out: Path, *, estimates: Path | None = None) -> RobotPrediction:
    """Write position and orientation of the real tool at the commands of `file`, in the base frame, to `out`, CSV or Parquet.

    Raises `FlexcalError` where there is no calibration or a file does not fit; then nothing is written.
    """
    calibrated = calibrated_robot(robot, estimates, "predict with")
    model = calibrated.probable
    commands = read_commands(file, model)
    assert commands.q is not None
    at = tool_at_rest(model, commands.q, commands.payload, commands.target)
    nominal = points_kinematics(calibrated.found, commands.q, None, commands.target, jacobians=False)
    payload = carried_mass(model, commands.payload, len(commands))
    certain = certain_flank(model, commands.q, at.rest.torque, payload)[:, list(model.backlash_joints)]
    tool = ToolTargets(
        pose=commands.pose,
        target=commands.target,
        position=at.kinematics.position,
        rotation=at.kinematics.orientation,
        payload=commands.payload,
    )
    write_targets(out, tool)
    return RobotPrediction(tool, at.kinematics.position - nominal.position, np.all(certain, axis=1))
