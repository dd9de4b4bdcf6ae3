"""Messages of ROS in MCAP files, by rosbags alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader

_KIND = "trajectory_msgs/msg/JointTrajectory"


def trajectory_in(file: Path) -> Any:
    """The one message of an MCAP file, a JointTrajectory for a trajectory controller."""
    with AnyReader([file]) as reader:
        (connection,) = reader.connections
        assert connection.topic == "/joint_trajectory_controller/joint_trajectory"
        ((_, _, raw),) = reader.messages()
        return reader.deserialize(raw, _KIND)
