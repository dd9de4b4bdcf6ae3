"""Predicted tool poses of the calibrated robot for motor commands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.data.poses import ToolTargets, read_commands, write_targets
from flexcal.jobs.inputs import calibrated_robot
from flexcal.model.robot import RobotModel
from flexcal.model.statics import carried_mass, certain_flank, points_kinematics, tool_at_rest
from flexcal.progress import Progress, silent

_BLOCK = 20_000
"""Commands whose tool poses are computed together."""


@dataclass(frozen=True, eq=False)
class Prediction:
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


def predict_robot(
    robot: Path, file: Path, out: Path, *, estimates: Path | None = None, progress: Progress = silent
) -> Prediction:
    """Write position and orientation of the real tool at the commands of `file`, in the base frame, to `out`, CSV or Parquet.

    Raises `FlexcalError` where there is no calibration or a file does not fit; then nothing is written.
    """
    calibrated = calibrated_robot(robot, estimates, "predict with")
    progress("reading", 0.0)
    commands = read_commands(file, calibrated.probable)
    progress("reading", 1.0)
    parts = []
    for first in range(0, len(commands), _BLOCK):
        progress("predicting", first / len(commands))
        block = commands.subset(slice(first, first + _BLOCK))
        parts.append(_predicted(calibrated.probable, calibrated.with_points, block))
    progress("predicting", 1.0)
    position, rotation, beside, certain = (np.concatenate(part) for part in zip(*parts, strict=True))
    tool = replace(commands, q=None, position=position, rotation=rotation)
    write_targets(out, tool)
    return Prediction(tool, beside, certain)


def _predicted(
    model: RobotModel, nominal: RobotModel, commands: ToolTargets
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions (N, 3), orientations (N, 3, 3), how far these positions are from the nominal robot's (N, 3), and sure flanks (N,)."""
    assert commands.q is not None
    at = tool_at_rest(model, commands.q, commands.payload, commands.target)
    there = points_kinematics(nominal, commands.q, None, commands.target, jacobians=False).position
    payload = carried_mass(model, commands.payload, len(commands))
    certain = certain_flank(model, commands.q, at.rest.torque, payload)[:, list(model.backlash_joints)]
    position = at.kinematics.position
    return position, at.kinematics.orientation, position - there, np.all(certain, axis=1)
