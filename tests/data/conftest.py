"""A small robot for the readers: only what they ask of a model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from flexcal.files.formats import read_yaml_file
from flexcal.model.robot import SignalConfig, Stations, WireConfig


@dataclass(frozen=True)
class JointStandIn:
    name: str
    lower: float = -3.0
    upper: float = 3.0
    kind: str = "revolute"


@dataclass(frozen=True)
class ConfigStandIn:
    signals: dict[str, SignalConfig] = field(default_factory=dict)
    measurements: dict[str, WireConfig] = field(default_factory=lambda: {"rope": WireConfig("wire")})


@dataclass(frozen=True)
class RobotStandIn:
    joints: tuple[JointStandIn, ...]
    config: ConfigStandIn
    path: Path
    points: dict[str, object]
    payload: object | None = "declared"
    reach: float = 1.2
    stations: Stations = field(default_factory=lambda: Stations.at_base(("tracker",)))
    sensors: dict[str, object] = field(default_factory=dict)
    relations: None = None

    @property
    def n(self) -> int:
        return len(self.joints)

    @property
    def joint_names(self) -> tuple[str, ...]:
        return tuple(joint.name for joint in self.joints)

    @property
    def motors(self) -> tuple[int, ...]:
        return tuple(range(self.n))

    @property
    def motor_joints(self) -> tuple[JointStandIn, ...]:
        return self.joints

    @property
    def motor_names(self) -> tuple[str, ...]:
        return self.joint_names


@dataclass(frozen=True)
class SignalsFile:
    robot: str
    signals: dict[str, SignalConfig]


@pytest.fixture
def make_robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Makes a two-joint robot without kinematics whose robot.yaml, with these lines under `signals:`, lies in `tmp_path`."""
    monkeypatch.setattr("flexcal.data.poses.checks._nominal_extent", lambda poses, model: None)
    monkeypatch.setattr("flexcal.data.poses.checks._check_size", lambda *_: None)

    def make(signals: str = "", **changes: Any) -> Any:
        path = tmp_path / "robot.yaml"
        path.write_text("robot: arm.urdf\nsignals:" + ("\n" + signals if signals else " {}") + "\n")
        values = {
            "joints": (JointStandIn("base"), JointStandIn("elbow")),
            "config": ConfigStandIn(read_yaml_file(path).structure(SignalsFile).signals),
            "path": path,
            "points": {"smr": object(), "ball": object()},
        }
        return RobotStandIn(**(values | changes))

    return make


@pytest.fixture(scope="session")
def make_joint() -> Callable[..., Any]:
    """Makes a joint: name, lower, upper, kind."""
    return JointStandIn


@pytest.fixture(scope="session")
def any_robot() -> Any:
    """The robot without `signals:` and without a file."""
    joints = (JointStandIn("base"), JointStandIn("elbow"))
    return RobotStandIn(joints, ConfigStandIn(), Path("robot.yaml"), {"smr": object(), "ball": object()})


@pytest.fixture
def robot(make_robot: Callable[..., Any]) -> Any:
    """The robot without `signals:`."""
    return make_robot()
