"""A folder of recorded files behaves as a cell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

from flexcal.data.experiments import Cell, FolderCell, labels, write_measured_poses, write_recordings
from flexcal.data.plans import MultisinePlan, PosePlan, write_plan
from flexcal.data.poses import PoseSet
from flexcal.data.recordings import Recording, RecordingLabel


def make_plan(joints: int = 2, **changes: Any) -> MultisinePlan:
    values: dict[str, Any] = {
        "name": "small",
        "poses": np.zeros((2, joints)),
        "joints": (0, 1),
        "base_frequency_hz": 1.0,
        "lines": np.array([3, 5]),
        "amplitude": np.ones((2, 2)),
        "periods": 2,
        "settle_periods": 1,
        "realisations": 2,
        "signs": True,
        "reference_amplitude": 0.0,
        "reference_frequency_hz": 0.5,
        "kp": np.ones(joints),
        "kd": np.ones(joints),
        "rate_hz": 100.0,
        "torque": "held",
        "seed": 1,
    }
    return MultisinePlan(**(values | changes))


def make_recording(label: RecordingLabel) -> Recording:
    rng = np.random.default_rng([label.pose, label.realisation, label.experiment, label.sign + 1])
    return Recording(0.01, rng.uniform(-1, 1, (200, 2)), rng.normal(size=(200, 2)), label=label)


def make_poses(q: np.ndarray) -> PoseSet:
    rows = len(q)
    return PoseSet(
        q=q,
        position=np.full((rows, 3), 0.5),
        sigma=np.full((rows, 3), 1e-5),
        torque=None,
        payload=None,
        target=np.full(rows, "smr"),
        station=np.full(rows, "tracker"),
        temperature=None,
        pose=np.arange(rows),
    )


def test_names_and_order() -> None:
    assert RecordingLabel(0, 3, 1, -1).name == "pose_1_realisation_4_experiment_2_minus"
    order = list(labels(make_plan()))
    assert len(order) == 2 * 2 * 2 * 2
    assert order[:3] == [RecordingLabel(0, 0, 0, 1), RecordingLabel(0, 0, 0, -1), RecordingLabel(0, 0, 1, 1)]
    assert all(label.sign == 1 for label in labels(make_plan(signs=False)))
    with refused("E-LOG-003"):
        RecordingLabel(0, 0, 0, 0)
    with refused("E-LOG-004"):
        RecordingLabel(-1, 0, 0, 1)


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_recordings_come_back(tmp_path: Path, robot: Any, ending: str) -> None:
    plan = make_plan()
    write_recordings(tmp_path / "experiment", plan, map(make_recording, labels(plan)), ending=ending)
    cell = FolderCell(tmp_path / "experiment", robot)
    assert isinstance(cell, Cell)
    for again, label in zip(cell.record(plan), labels(plan), strict=True):
        written = make_recording(label)
        assert again.label == label
        assert np.array_equal(again.q, written.q)
        assert np.array_equal(again.torque, written.torque)
        assert again.time_step == 0.01
    assert len(list(cell.record())) == 16


def test_incomplete_recordings_are_refused(tmp_path: Path, robot: Any) -> None:
    plan = make_plan()
    every = list(map(make_recording, labels(plan)))
    with refused("E-EXP-004", "1", "pose_2_realisation_2_experiment_2_minus"):
        write_recordings(tmp_path, plan, every[:-1])
    with refused("E-FILE-001", "plan.yaml"):
        FolderCell(tmp_path, robot)
    with refused("E-EXP-003"):
        write_recordings(tmp_path, plan, [every[0], every[0]])
    write_plan(tmp_path / "plan.yaml", plan)
    with refused("E-EXP-001", "pose_2_realisation_2_experiment_2_minus.csv"):
        FolderCell(tmp_path, robot).record(plan)


def test_folders_that_do_not_fit(tmp_path: Path, robot: Any) -> None:
    plan = make_plan()
    write_recordings(tmp_path, plan, map(make_recording, labels(plan)))
    cell = FolderCell(tmp_path, robot)
    with refused("E-EXP-011", "seed"):
        cell.record(make_plan(seed=2))
    cell.record(make_plan(name="other name"))
    with refused("E-EXP-008", "multisine"):
        cell.measure()
    (tmp_path / "pose_1_realisation_1_experiment_1_plus.csv").write_text("t\n")
    with refused("E-EXP-002"):
        cell.record()
    with refused("E-EXP-005"):
        FolderCell(tmp_path / "none", robot)
    write_plan(tmp_path / "plan.yaml", make_plan(joints=3))
    with refused("E-EXP-006", "3", "2"):
        FolderCell(tmp_path, robot)


def test_poses_come_back(tmp_path: Path, robot: Any) -> None:
    plan = PosePlan(np.array([[0.1, 0.2], [0.5, -0.6], [0.5, -0.6]]))
    write_measured_poses(tmp_path, plan, make_poses(plan.q + 1e-3))
    cell = FolderCell(tmp_path, robot)
    assert np.array_equal(cell.measure(plan).q, plan.q + 1e-3)
    with refused("E-EXP-007"):
        cell.record()
    with refused("E-EXP-011", "q"):
        cell.measure(PosePlan(plan.q + 0.01))


def test_poses_of_another_plan(tmp_path: Path, robot: Any) -> None:
    plan = PosePlan(np.array([[0.1, 0.2], [0.5, -0.6]]))
    write_measured_poses(tmp_path, plan, make_poses(plan.q[:1]))
    with refused("E-EXP-009", "1", "2"):
        FolderCell(tmp_path, robot).measure()
    write_measured_poses(tmp_path, plan, make_poses(plan.q[::-1]))
    with refused("E-EXP-010", "q1", "0", "0.4"):
        FolderCell(tmp_path, robot).measure()
