"""Plans: YAML round trip, and one sentence with the line for what does not fit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused

from flexcal.data.plans import MultisinePlan, PosePlan, read_plan, read_plan_of, write_plan
from flexcal.files.formats import to_plain


def make_plan(**changes: Any) -> MultisinePlan:
    values: dict[str, Any] = {
        "name": "small",
        "poses": np.array([[0.1, -0.4, 0.2], [0.0, 1 / 3, 0.0]]),
        "joints": (0, 2),
        "payload": 6.0,
        "base_frequency_hz": 0.25,
        "lines": np.array([13, 15, 19]),
        "detection_lines": np.array([17]),
        "amplitude": np.array([[1.0, 2.0, 3.0], [0.1, 0.2, 0.3]]),
        "periods": 4,
        "settle_periods": 2,
        "realisations": 3,
        "signs": True,
        "reference_amplitude": 0.026,
        "reference_frequency_hz": 2.125,
        "kp": np.array([3e3, 800.0, 60.0]),
        "kd": np.array([400.0, 20.0, 4.0]),
        "rate_hz": 4000.0,
        "torque": "mean",
        "seed": 2**40,
    }
    return MultisinePlan(**(values | changes))


def test_multisine_round_trip(tmp_path: Path) -> None:
    plan = make_plan()
    write_plan(tmp_path / "plan.yaml", plan)
    again = read_plan_of(tmp_path / "plan.yaml", MultisinePlan)
    assert to_plain(again) == to_plain(plan)
    assert again.joints == (0, 2)
    assert again.lines.dtype == np.int64
    assert again.torque == "mean"
    text = (tmp_path / "plan.yaml").read_text()
    assert "joints: [1, 3]" in text
    assert "tau: mean" in text


def test_what_may_be_left_out(tmp_path: Path) -> None:
    plan = make_plan(payload=None, detection_lines=np.zeros(0, int))
    write_plan(tmp_path / "plan.yaml", plan)
    text = (tmp_path / "plan.yaml").read_text().replace("detection_lines: []\n", "")
    (tmp_path / "plan.yaml").write_text(text)
    again = read_plan_of(tmp_path / "plan.yaml", MultisinePlan)
    assert again.payload is None
    assert again.detection_lines.tolist() == []


def test_derived_numbers() -> None:
    plan = make_plan()
    assert plan.experiments == 2
    assert plan.recordings_per_pose == 3 * 2 * 2
    assert make_plan(signs=False).recordings_per_pose == 3 * 2
    assert plan.frequencies_hz.tolist() == [3.25, 3.75, 4.75]
    assert plan.duration == 16.0


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.lists(st.floats(-7, 7), min_size=3, max_size=3), min_size=1, max_size=5),
    st.integers(0, 2**60),
)
def test_pose_plan_round_trip(
    tmp_path_factory: pytest.TempPathFactory, q: list[list[float]], seed: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "poses.yaml"
    plan = PosePlan(np.array(q), np.linspace(0, 6, len(q)), seed)
    write_plan(path, plan)
    again = read_plan_of(path, PosePlan)
    assert np.array_equal(again.q, plan.q)
    assert to_plain(again) == to_plain(plan)
    assert len(again) == len(q)


def test_one_payload_counts_for_all_poses() -> None:
    plan = PosePlan(np.zeros((3, 2)), np.array(2.5))
    assert plan.payload is not None
    assert plan.payload.tolist() == [2.5, 2.5, 2.5]
    assert PosePlan(np.zeros((3, 2))).payload is None


@pytest.mark.parametrize(
    ("old", "new", "refusal"),
    [
        ("kind: multisine", "kind: sine", ["E-PLAN-021", "line 1", "multisine, trajectory, poses"]),
        ("kind: multisine\n", "", ["E-PLAN-021", "line 1"]),
        ("periods: 4", "perids: 4", ["E-YAML-001", "perids", "periods"]),
        ("tau: mean", "torque: mean", ["E-YAML-001", "torque"]),
        ("tau: mean\n", "", ["E-YAML-002", "tau"]),
        ("tau: mean", "tau: heldd", ["E-YAML-032", "tau", "'held', 'instantaneous', 'mean'", "held"]),
        ("joints: [1, 3]", "joints: [0, 2]", ["E-YAML-022", "joints[0]"]),
        ("joints: [1, 3]", "joints: [1, 4]", ["E-PLAN-003", "4", "3"]),
        ("joints: [1, 3]", "joints: 1", ["E-YAML-021", "joints"]),
        ("rate_hz: 4000.0", "rate_hz: fast", ["E-YAML-025", "rate_hz"]),
        ("seed: ", "seed: -", ["E-PLAN-020", "seed"]),
    ],
)
def test_sentences(tmp_path: Path, old: str, new: str, refusal: list[str]) -> None:
    path = tmp_path / "plan.yaml"
    write_plan(path, make_plan())
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with refused(*refusal) as caught:
        read_plan(path)
    assert str(caught.value).startswith(f"{path} line ")


def test_another_kind_of_plan(tmp_path: Path) -> None:
    write_plan(tmp_path / "plan.yaml", make_plan())
    with refused("E-PLAN-022", "multisine", "poses"):
        read_plan_of(tmp_path / "plan.yaml", PosePlan)
    (tmp_path / "list.yaml").write_text("- 1\n")
    with refused("E-PLAN-021", "line 1"):
        read_plan(tmp_path / "list.yaml")


@pytest.mark.parametrize(
    ("changes", "refusal"),
    [
        ({"poses": np.zeros(3)}, ["E-PLAN-001"]),
        ({"joints": ()}, ["E-PLAN-002"]),
        ({"joints": (0, 0)}, ["E-PLAN-002"]),
        ({"kp": np.ones(2)}, ["E-PLAN-004", "kp", "2"]),
        ({"lines": np.zeros(0, int)}, ["E-PLAN-005"]),
        ({"amplitude": np.ones((2, 4))}, ["E-PLAN-006"]),
        ({"lines": np.array([13, 15, 17])}, ["E-PLAN-007"]),
        ({"lines": np.array([0, 15, 19])}, ["E-PLAN-007"]),
        ({"lines": np.array([15, 13, 19])}, ["E-PLAN-007"]),
        ({"base_frequency_hz": 0.0}, ["E-PLAN-016"]),
        ({"rate_hz": 9.0}, ["E-PLAN-008"]),
        ({"settle_periods": 4}, ["E-PLAN-018"]),
        ({"realisations": 0}, ["E-PLAN-009"]),
        ({"reference_amplitude": -1.0}, ["E-PLAN-010"]),
        ({"payload": -1.0}, ["E-PLAN-019"]),
    ],
)
def test_values_are_checked(changes: dict[str, Any], refusal: list[str]) -> None:
    with refused(*refusal):
        make_plan(**changes)


@pytest.mark.parametrize(
    ("arguments", "refusal"),
    [
        ((np.zeros(3),), ["E-PLAN-027"]),
        ((np.zeros((3, 2)), np.zeros(2)), ["E-PLAN-028", "2", "3"]),
        ((np.zeros((3, 2)), np.array(-1.0)), ["E-PLAN-029"]),
        ((np.zeros((3, 2)), None, -1), ["E-PLAN-031"]),
    ],
)
def test_pose_plan_is_checked(arguments: tuple[Any, ...], refusal: list[str]) -> None:
    with refused(*refusal):
        PosePlan(*arguments)
