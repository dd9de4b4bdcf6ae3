"""Calibration of a Franka Panda by a ball in sockets, against the published method (CasADi and Ipopt) on the same poses."""

from __future__ import annotations

import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from benchmarks.peers import run_peer
from flexcal import RobotModel, calibrate, read_poses
from flexcal.jobs.calibration.held_out import HeldOut

FOLDER = Path(__file__).parent.parent / "examples" / "panda_sockets"


def run() -> list[tuple[str, float, str]]:
    """Ratio of the times of one calibration, ours with its choice of terms, of two arms; the errors at places left out are in the note.

    Of the second arm the place that disagrees with the others is left out, as in the publication.
    """
    model = RobotModel.from_yaml(FOLDER / "robot.yaml", estimates=False)
    joints = {joint.get("name"): joint for joint in ElementTree.parse(FOLDER / "panda.urdf").iter("joint")}
    rows = []
    for arm in ("panda_3", "panda_2"):
        poses = read_poses(FOLDER / f"{arm}.csv", model)
        poses = poses.subset(poses.station != "high")
        assert poses.socket is not None
        request = {
            "origins": [_origin(joints[joint.name]) for joint in model.joints],
            "ball": model.point().translation.tolist(),
            "q": poses.q.tolist(),
            "place": poses.station.tolist(),
            "socket": poses.socket.tolist(),
            "distance": 0.05,
        }
        peer = run_peer("casadi_sockets.py", ("casadi>=3.6", "numpy"), request)
        calibrate(model, poses.subset(slice(None, None, 4)), terms=["kinematic"])
        started = time.perf_counter()
        calibrate(model, poses)
        seconds = time.perf_counter() - started
        held_out = calibrate(model, poses, hold_out=("fixture", poses.station)).held_out
        assert isinstance(held_out, HeldOut) and held_out.distance is not None
        note = (
            f"{peer['seconds']:.2f} s ({peer['mean_mm']:.3f} mm at places left out, distance {peer['distance_mm']:.3f} mm) against "
            f"{seconds:.2f} s ({held_out.mean * 1e3:.3f} mm, {held_out.distance * 1e3:.3f} mm)"
        )
        rows.append((f"{arm}, ball in sockets, CasADi and Ipopt", peer["seconds"] / seconds, note))
    return rows


def _origin(joint: ElementTree.Element) -> list[float]:
    """Position, m, and roll, pitch and yaw, rad, of a joint in its parent link."""
    origin = joint.find("origin")
    assert origin is not None
    return [float(value) for key in ("xyz", "rpy") for value in origin.get(key, "0 0 0").split()]
