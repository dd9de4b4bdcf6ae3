"""Recordings of Universal Robots' real-time interface: what is measured is taken, what the controller wanted or computed is not."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from flexcal.importing.columns import guess_columns, reasons_unused

VECTORS = [
    "target_q",
    "target_qd",
    "target_qdd",
    "target_current",
    "target_moment",
    "actual_q",
    "actual_qd",
    "actual_current",
    "actual_current_window",
    "joint_control_output",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "target_TCP_pose",
    "target_TCP_speed",
    "joint_temperatures",
    "joint_mode",
    "actual_joint_voltage",
    "tcp_offset",
]
SINGLES = [
    "actual_execution_time",
    "robot_mode",
    "speed_scaling",
    "actual_main_voltage",
    "actual_robot_current",
]


def recording(rng: np.random.Generator, step: float, *more: str) -> Mapping[str, np.ndarray]:
    """All that such a recording has by default, every `step` seconds."""
    columns = {"timestamp": 4711.0 + step * np.arange(40)}
    columns |= {f"{name}_{i}": rng.uniform(-1, 1, 40) for name in (*VECTORS, *more) for i in range(6)}
    return columns | {name: rng.uniform(0, 1, 40) for name in SINGLES}


def first_columns(guess) -> dict[str, tuple[str, str | None]]:
    return {quantity: (placed.columns[0], placed.unit) for quantity, placed in guess.placed.items()}


def test_a_log(ur5, made, rng: np.random.Generator) -> None:
    guess = guess_columns(made(recording(rng, 0.008)), ur5)
    assert first_columns(guess) == {
        "t": ("timestamp", "s"), "q": ("actual_q_0", "rad"), "dq": ("actual_qd_0", "rad/s")
    }  # fmt: skip
    assert all("Universal Robots" in placed.why for placed in guess.placed.values())
    reasons = reasons_unused(guess.left_out)
    for columns, words in [
        ("actual_current_0 … actual_current_5", "--map 'tau1=GAIN*actual_current_0[A]'"),
        ("target_moment_0 … target_moment_5", "computed by the controller's model, not measured"),
        ("actual_TCP_pose_0 … actual_TCP_pose_2", "tool pose computed by the controller"),
        ("actual_TCP_pose_3 … actual_TCP_pose_5", "rotation vector"),
        ("target_q_0 … target_q_5, target_qd_0 … target_qd_5, target_qdd_0 … target_qdd_5", "commanded"),
    ]:
        assert any(columns in reason and words in reason for reason in reasons), columns
    assert not any("could both begin" in reason for reason in reasons)


def test_torques_where_the_controller_records_them(ur5, made, rng: np.random.Generator) -> None:
    guess = guess_columns(made(recording(rng, 0.002, "actual_current_as_torque")), ur5)
    assert first_columns(guess)["tau"] == ("actual_current_as_torque_0", "N m")


def test_poses_one_by_one(ur5, made, rng: np.random.Generator) -> None:
    """Half a minute apart: the tool's position is shown, as no measurement; points of an instrument go before it."""
    columns = recording(rng, 30.0)
    guess = guess_columns(made(columns), ur5)
    assert first_columns(guess)["xyz"] == ("actual_TCP_pose_0", "m") and guess.placed["t"].unit == "s"
    assert "not measured" in guess.placed["xyz"].why
    tracked = guess_columns(made({**columns, **{f"{a} [mm]": rng.uniform(0, 900, 40) for a in "XYZ"}}), ur5)
    assert first_columns(tracked)["xyz"] == ("X [mm]", "mm")
    assert any("X [mm] … are taken as xyz" in reason for reason in reasons_unused(tracked.left_out))


def test_degrees_and_seven_joints(ur5, made, rng: np.random.Generator) -> None:
    columns = {f"actual_q_{i}": 90 * rng.uniform(-1, 1, 40) for i in range(6)}
    assert guess_columns(made(columns), ur5).placed["q"].unit == "deg"
    seven = {**columns, "actual_q_6": columns["actual_q_0"]}
    assert guess_columns(made(seven), ur5).placed["q"].columns[0] == "actual_q_0"
    assert "q" not in guess_columns(made({k: columns[k] for k in list(columns)[:5]}), ur5).placed


@pytest.mark.parametrize("name", ["TCP_speed_", "cartesian_velocity_"])
def test_speeds_of_the_tool_are_no_joints(ur5, made, rng: np.random.Generator, name: str) -> None:
    columns = {f"{stem}{i}": rng.uniform(-1, 1, 40) for stem in ("q", "dq", name) for i in range(1, 7)}
    assert first_columns(guess_columns(made(columns), ur5))["dq"][0] == "dq1"
