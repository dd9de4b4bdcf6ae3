"""Recordings of ROS: MCAP, rosbag2 and bags of ROS 1, through rosbags."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.data.tables import Table, TableFile
from flexcal.errors import InputError
from flexcal.files.formats import read_yaml_file
from flexcal.files.transaction import open_regular, regular_path
from flexcal.importing.readers.standstill import points_at_rest
from flexcal.importing.tables import ForeignTable

_JOINTS = "sensor_msgs/msg/JointState"
_POINTS = ("geometry_msgs/msg/PointStamped", "geometry_msgs/msg/PoseStamped")
_METADATA = "metadata.yaml"
_FIELDS = {"position": "rad", "velocity": "rad/s", "effort": "N m"}
_LONGEST = 64
"""Bytes of the first line of a recording of ROS 1."""


@dataclass(frozen=True, eq=False)
class _Stream:
    """Values of one topic: `stamped` (N,) by their senders and `received` (N,), s; names and fields of joints, or points (N, 3)."""

    topic: str
    stamped: np.ndarray
    received: np.ndarray
    fields: dict[str, np.ndarray]
    names: tuple[str, ...] = ()


def read_ros(path: Path, joints: Sequence[str], topic: str | None) -> ForeignTable:
    """Joint states as a log; with measured points beside them (PointStamped, PoseStamped), the poses in which the robot stood still.

    Of several messages with joint states those with most of `joints` are taken. Times are those of the senders, or of reception where
    some have none. Raises `InputError` where rosbags is not installed, the recording cannot be read, has no joint states, or has points
    of several topics and `topic` names none of them.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(
            "E-IMPORT-035", f"{path}: recordings of ROS need rosbags: pip install rosbags."
        ) from None
    if path.is_dir():
        read_yaml_file(path / _METADATA)  # its errors name the line
        for file in path.iterdir():
            regular_path(file, limit=None)
    notes: list[str] = []
    try:
        if path.suffix.lower() == ".bag":  # whose first line rosbags reads, however long
            with open_regular(path, limit=None) as stream:
                if not stream.readline(_LONGEST).endswith(b"\n"):
                    raise ValueError
        with AnyReader(
            [regular_path(path, limit=None)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)
        ) as reader:
            kinds = {c.topic: c.msgtype for c in reader.connections}
            chosen = _point_topic(path, kinds, topic)
            states = _joint_states(reader, notes)
            points = None if chosen is None else _points(reader, chosen, notes)
    except InputError:
        raise
    except Exception as problem:  # whatever a reader of a foreign, perhaps broken file may raise
        raise InputError(
            "E-IMPORT-036",
            f"{path}: not a readable recording of ROS ({_reason(problem)}); record it again, with joint states and points alone.",
        ) from problem
    if not states:
        raise InputError("E-IMPORT-037", f"{path}: {_without_states(kinds, notes)}")
    best = max(states, key=lambda s: (len(set(s.names) & set(joints)), len(s.names), len(s.received)))
    notes += [
        f"the joint states of {', '.join(other.names)} on {other.topic} are left out"
        for other in states
        if other is not best
    ]
    if points is None:
        return _log(path, best, notes)
    return _poses(path, best, points, notes)


def _reason(problem: Exception) -> str:
    """Reason given by rosbags for an unreadable recording; in general words for unexpected exceptions."""
    own = type(problem).__module__.startswith("rosbags.") or isinstance(problem, OSError)
    text = " ".join(str(problem).split())[:200].rstrip(".")
    return text if own and text else "its content is not as ROS writes it"


def _without_states(kinds: dict[str, str], notes: Sequence[str]) -> str:
    """Reason why a recording with topics of these `kinds` has no joint states."""
    named = sorted(topic for topic, kind in kinds.items() if kind == _JOINTS)
    if not named:
        seen = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(kinds.items()))
        return f"there are no joint states (sensor_msgs/JointState) in it; there are {seen or 'no messages'}."
    reason = "; ".join(notes) or f"there are no messages on {', '.join(named)}"
    return f"there are no usable joint states in it: {reason}; record it again."


def _point_topic(path: Path, kinds: dict[str, str], asked: str | None) -> str | None:
    having = sorted(name for name, kind in kinds.items() if kind in _POINTS)
    if asked is not None:
        if asked not in having:
            raise InputError(
                "E-IMPORT-038",
                f"{path}: there are no points on the topic '{asked}'; there are some on {', '.join(having) or 'none'}.",
            )
        return asked
    if len(having) > 1:
        raise InputError(
            "E-IMPORT-039", f"{path}: several topics have points: {', '.join(having)}; name one with --topic."
        )
    return having[0] if having else None


def _joint_states(reader: Any, notes: list[str]) -> list[_Stream]:
    """A stream for every topic and set of names; what is left out is added to the `notes`."""
    messages: dict[tuple[str, tuple[str, ...]], list[tuple[float, float, list[np.ndarray]]]] = {}
    without: Counter[str] = Counter()
    for topic, received, message in _messages(reader, (_JOINTS,), notes):
        values = [np.asarray(getattr(message, field), dtype=float) for field in _FIELDS]
        names = tuple(message.name)
        if len(values[0]) == len(names) > 0:
            messages.setdefault((topic, names), []).append((_stamp(message), received, values))
        else:
            without[topic] += 1
    notes += [
        f"messages on {topic} without a position for every joint name, left out: {count}"
        for topic, count in without.items()
    ]
    streams = []
    for (topic, names), rows in messages.items():
        fields = {}
        for k, field in enumerate(_FIELDS):
            if all(len(row[2][k]) == len(names) for row in rows):
                fields[field] = np.array([row[2][k] for row in rows])
        streams.append(_stream(topic, rows, fields, names))
    return streams


def _points(reader: Any, topic: str, notes: list[str]) -> _Stream:
    rows = []
    for name, received, message in _messages(reader, _POINTS, notes):
        if name == topic:
            place = message.point if hasattr(message, "point") else message.pose.position
            rows.append((_stamp(message), received, [place.x, place.y, place.z]))
    return _stream(topic, rows, {"xyz": np.array([row[2] for row in rows], dtype=float).reshape(-1, 3)})


def _messages(reader: Any, kinds: Sequence[str], notes: list[str]) -> Any:
    """Topic, time of reception, s, and message; a number of messages other than the recording announces is added to the `notes`."""
    connections = [c for c in reader.connections if c.msgtype in kinds]
    read: Counter[str] = Counter()
    for connection, received, raw in reader.messages(connections=connections) if connections else ():
        read[connection.topic] += 1
        yield connection.topic, received * 1e-9, reader.deserialize(raw, connection.msgtype)
    announced: Counter[str] = Counter()
    for connection in connections:
        announced[connection.topic] += connection.msgcount
    notes += [
        f"{count} messages on {topic} are announced, but {read[topic]} are there: the recording is damaged or incomplete"
        for topic, count in announced.items()
        if count != read[topic]
    ]


def _stamp(message: Any) -> float:
    stamp = message.header.stamp
    return stamp.sec + stamp.nanosec * 1e-9


def _stream(
    topic: str,
    rows: Sequence[tuple[float, float, Any]],
    fields: dict[str, np.ndarray],
    names: tuple[str, ...] = (),
) -> _Stream:
    return _Stream(
        topic, np.array([row[0] for row in rows]), np.array([row[1] for row in rows]), fields, names
    )


def _log(path: Path, states: _Stream, notes: list[str]) -> ForeignTable:
    t = states.stamped if states.stamped.all() else states.received
    columns = {"t": t - t[0]}
    units = {"t": "s"}
    for field, values in states.fields.items():
        for k, name in enumerate(states.names):
            columns[f"{name} {field}"] = values[:, k]
            units[f"{name} {field}"] = _FIELDS[field]
    if "effort" in states.fields:
        notes.append("effort is taken to be in N m at the joint; some drivers put currents there")
    return _table(path, columns, units, notes)


def _poses(path: Path, states: _Stream, points: _Stream, notes: list[str]) -> ForeignTable:
    same_clock = bool(states.stamped.all() and points.stamped.all())
    t, at = (states.stamped, points.stamped) if same_clock else (states.received, points.received)
    q, xyz, sigma, without = points_at_rest(t, states.fields["position"], at, points.fields["xyz"])
    if not len(q):
        raise InputError(
            "E-IMPORT-040",
            f"{path}: while there are points on {points.topic}, the robot never stands still for half a second; let it rest in every pose.",
        )
    columns: dict[str, np.ndarray] = {"pose": np.arange(1.0, len(q) + 1)}
    units: dict[str, str] = {}
    for k, name in enumerate(states.names):
        columns[f"{name} position"] = q[:, k]
        units[f"{name} position"] = "rad"
    columns |= {axis: xyz[:, k] for k, axis in enumerate("xyz")}
    units |= dict.fromkeys("xyz", "m")
    notes.append(
        f"{len(q)} poses in which the robot stood still and {points.topic} has points, both averaged"
    )
    if without:
        notes.append(f"{without} standstills without points are left out")
    if sigma is not None:
        columns["sigma"], units["sigma"] = np.full(len(q), sigma), "m"
        notes.append("sigma is the scatter of the readings about the mean of their pose")
    if not same_clock:
        notes.append("some messages have no time stamps, so the times of reception are used")
    return _table(path, columns, units, notes)


def _table(
    path: Path, columns: dict[str, np.ndarray], units: dict[str, str], notes: list[str]
) -> ForeignTable:
    return ForeignTable(Table(TableFile(path, tuple(columns), 1), 1, columns), units, notes=tuple(notes))
