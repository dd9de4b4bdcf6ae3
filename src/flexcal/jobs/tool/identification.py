"""Identification of a tool: a robot model and touches of fixed points in, the place of the tip out."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.touching import fit_tip
from flexcal.data.poses import Touches
from flexcal.jobs.tool.result import ToolIdentification
from flexcal.model.robot import Posterior, RobotModel, last_frame, with_point


def identify_tip(
    model: RobotModel,
    touches: Touches,
    *,
    frame: str | None = None,
    name: str = "tip",
    unseen: Posterior | None = None,
) -> ToolIdentification:
    """Find where the tip of a tool is in a frame of the robot (tool centre point), from poses in which it touched fixed points.

    Parameters
    ----------
    model : RobotModel
        Robot, calibrated or not: what its calibration leaves, or typical errors of joints, are correlated errors of the poses.
    touches : Touches
        At least three poses for one fixed point, in different orientations.
    frame : str, optional
        URDF frame in which the tip is sought; by default that of the first point of robot.yaml, else the last one.
    name : str
        Name of the tip.
    unseen : Posterior, optional
        Part of the posterior that the measured points of a calibration left open, as of `CalibratedRobot.unseen`, where `model` is its
        `probable` robot.

    Returns
    -------
    ToolIdentification
        Its `xyz`, `half_width`, `outliers`, `summary()` and `document()`.

    Raises
    ------
    FlexcalError
        For an unknown frame, too few touches, and orientations that do not determine the tip, with the motion that is missing.
    """
    first = next(iter(model.points.values()), None)
    chosen = frame or (last_frame(model) if first is None else first.frame)
    placed = with_point(model, name, chosen, np.zeros(3))
    return ToolIdentification(model, touches, name, fit=fit_tip(placed, touches, name, unseen), frame=chosen)
