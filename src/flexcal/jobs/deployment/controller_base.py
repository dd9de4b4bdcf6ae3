"""Frame in which a controller gives poses."""

from __future__ import annotations

from flexcal.model.robot import RobotModel
from flexcal.model.urdf import read_urdf
from flexcal.programs import Pose

_BASE = "base"
"""Frame of a robot's URDF in which its controller gives poses: that of a Universal Robots' arm is turned by half a turn."""


def controller_base(nominal: RobotModel) -> Pose:
    """Pose of the controller's base frame in the root frame of the URDF: its frame `base`, or the root where it has no fixed one."""
    known = read_urdf(nominal.urdf, nominal.config.locked).frames.get(_BASE)
    return Pose.identity() if known is None or known.joint >= 0 else Pose(known.translation, known.rotation)
