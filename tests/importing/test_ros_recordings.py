"""Recordings that rosbags writes: joint states alone are a log; with points beside them, the poses in which the robot stood still."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.importing.columns import guess_columns
from flexcal.importing.readers import read_foreign
from flexcal.model.kinematics import point_kinematics

pytest.importorskip("rosbags")
ORDER = [3, 1, 5, 0, 2, 4]
RATE = 50
NOISE = 3e-5


def write(path: Path, storage: str, joints, messages) -> Path:
    """A rosbag2 of (topic, time, values): joint positions on /joint_states, points elsewhere."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types

    def header(t: float):
        time = types["builtin_interfaces/msg/Time"](sec=int(t), nanosec=round(t % 1 * 1e9))
        return types["std_msgs/msg/Header"](stamp=time, frame_id="")

    with Writer(path, version=9, storage_plugin=StoragePlugin[storage]) as writer:
        topics = {}
        for topic, t, values in messages:
            kind = (
                "sensor_msgs/msg/JointState" if topic == "/joint_states" else "geometry_msgs/msg/PointStamped"
            )
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=store)
            if topic == "/joint_states":
                message = types[kind](
                    header=header(t), name=joints, position=values, velocity=0 * values, effort=2 * values
                )
            else:
                message = types[kind](
                    header=header(t), point=types["geometry_msgs/msg/Point"](*map(float, values))
                )
            writer.write(topics[topic], round((t + 0.004) * 1e9), store.serialize_cdr(message, kind))
    return path


def stop_and_go(ur5, q: np.ndarray, rng: np.random.Generator, *, points: bool):
    """A second on the way to each pose, then one at rest; a point every tenth of a second."""
    for k in range(len(q) * 2 * RATE):
        i, phase = divmod(k, 2 * RATE)
        share = min(1.0, phase / RATE)
        now = (1 - share) * q[i - 1] + share * q[i]
        t = 100.0 + k / RATE
        yield "/joint_states", t, now[ORDER] + rng.normal(0, 1e-6, 6)
        if points and k % 5 == 0:
            yield (
                "/tracker",
                t,
                point_kinematics(ur5, now[None], jacobians=False).position[0] + rng.normal(0, NOISE, 3),
            )


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
def test_poses_where_the_robot_stands_still(ur5, tmp_path: Path, rng, storage: str) -> None:
    q = rng.uniform(-1.5, 1.5, (8, 6))
    joints = [ur5.joint_names[i] for i in ORDER]
    path = write(tmp_path / "bag", storage, joints, stop_and_go(ur5, q, rng, points=True))
    for given in (path, next(p for p in path.iterdir() if p.suffix != ".yaml")):
        foreign = read_foreign(given, ur5.joint_names)
        guess = guess_columns(foreign, ur5)
        found = {quantity: placed.values(foreign.table) for quantity, placed in guess.placed.items()}
        assert set(found) == {"pose", "q", "xyz", "sigma"} and guess.left_out == ()
        np.testing.assert_allclose(found["q"], q, atol=2e-6)
        nominal = point_kinematics(ur5, q, jacobians=False).position
        assert np.abs(found["xyz"] - nominal).max() < 4 * NOISE / np.sqrt(5)
        assert found["sigma"][0, 0] == pytest.approx(NOISE, rel=0.25) and np.ptp(found["sigma"]) == 0


def test_joint_states_alone_are_a_log(ur5, tmp_path: Path, rng) -> None:
    q = rng.uniform(-1.5, 1.5, (3, 6))
    messages = list(stop_and_go(ur5, q, rng, points=False))
    foreign = read_foreign(
        write(tmp_path / "bag", "MCAP", [ur5.joint_names[i] for i in ORDER], messages), ur5.joint_names
    )
    placed = guess_columns(foreign, ur5).placed
    logged = np.array([values for _, _, values in messages])
    np.testing.assert_array_equal(placed["q"].values(foreign.table)[:, ORDER], logged)
    np.testing.assert_array_equal(placed["tau"].values(foreign.table)[:, ORDER], 2 * logged)
    np.testing.assert_allclose(np.diff(placed["t"].values(foreign.table)[:, 0]), 1 / RATE, atol=1e-6)


def test_what_cannot_be_used_is_said(ur5, tmp_path: Path, rng) -> None:
    q = rng.uniform(-1.5, 1.5, (2, 6))
    both = [*stop_and_go(ur5, q, rng, points=True), ("/other", 100.0, np.ones(3))]
    path = write(tmp_path / "two", "MCAP", list(ur5.joint_names), both)
    with refused("E-IMPORT-039", "/other, /tracker"):
        read_foreign(path, ur5.joint_names)
    with refused("E-IMPORT-038", "/third"):
        read_foreign(path, ur5.joint_names, topic="/third")
    assert len(read_foreign(path, ur5.joint_names, topic="/tracker")) == 2
    with refused("E-IMPORT-040"):
        read_foreign(path, ur5.joint_names, topic="/other")
    points = write(tmp_path / "points", "MCAP", [], [("/tracker", 1.0, np.ones(3))])
    with refused("E-IMPORT-037", "no joint states"):
        read_foreign(points, ur5.joint_names)


def test_messages_that_are_lost_or_useless_are_counted(ur5, tmp_path: Path, rng) -> None:
    """A recording that was cut off announces more than it holds; a driver that starts up sends names without positions."""
    q = rng.uniform(-1.5, 1.5, (3, 6))
    messages = list(stop_and_go(ur5, q, rng, points=False))
    names = [ur5.joint_names[i] for i in ORDER]
    messages[7] = ("/joint_states", messages[7][1], np.zeros(0))
    path = write(tmp_path / "bag", "SQLITE3", names, messages)
    with sqlite3.connect(next(path.glob("*.db3"))) as storage:
        storage.execute("DELETE FROM messages WHERE id > 200")
    foreign = read_foreign(path, ur5.joint_names)
    assert len(foreign) == 199
    assert foreign.notes[:2] == (
        "300 messages on /joint_states are announced, but 200 are there: the recording is damaged or incomplete",
        "messages on /joint_states without a position for every joint name, left out: 1",
    )
    with sqlite3.connect(next(path.glob("*.db3"))) as storage:
        storage.execute("DELETE FROM messages WHERE id != 8")
    with refused("E-IMPORT-037", "300 messages", "1 are there") as caught:
        read_foreign(path, ur5.joint_names)
    assert "left out: 1" in str(caught.value)
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: [\n")
    with refused("E-YAML-004", "metadata.yaml", "line 3"):
        read_foreign(path, ur5.joint_names)
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: 3\n")
    with refused("E-IMPORT-036"):
        read_foreign(path, ur5.joint_names)
