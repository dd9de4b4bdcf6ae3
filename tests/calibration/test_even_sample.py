"""Very many points: which of them are fitted, and that their errors are those of all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.calibration.accuracy import visit_statistics
from flexcal.calibration.accuracy.pose_repeatability import SAME_COMMAND
from flexcal.calibration.fit import StratifiedSample
from flexcal.data.poses import PoseSet


def poses_of(
    q: np.ndarray, pose: np.ndarray, target: np.ndarray | None = None, station: np.ndarray | None = None
) -> PoseSet:
    rows = len(q)
    return PoseSet(
        q=q,
        pose=pose,
        position=np.random.default_rng(1).standard_normal((rows, 3)),
        sigma=np.full((rows, 3), 1e-4),
        target=np.full(rows, "a") if target is None else target,
        station=np.full(rows, "s") if station is None else station,
        torque=None,
        payload=None,
        temperature=None,
    )


def test_few_points_are_all_taken() -> None:
    q = np.random.default_rng(0).uniform(-1, 1, (100, 6))
    assert StratifiedSample.of(poses_of(q, np.arange(100)), 100) is None


def test_distinct_poses_keep_visits_whole_and_small_stations() -> None:
    """Two targets a pose, and one of three stations with a hundredth of the poses."""
    rng = np.random.default_rng(2)
    q = np.repeat(rng.uniform(-2, 2, (5000, 6)), 2, axis=0)
    pose = np.repeat(np.arange(5000), 2)
    station = np.repeat(np.where(np.arange(5000) < 50, "rare", np.where(np.arange(5000) < 2500, "b", "c")), 2)
    poses = poses_of(q, pose, target=np.tile(["a", "b"], 5000), station=station)
    found = StratifiedSample.of(poses, 1000)
    assert found is not None and found.total == 10_000 and 900 <= len(found.rows) <= 1200
    assert (np.diff(found.rows) > 0).all()
    assert (np.bincount(pose[found.rows], minlength=5000) != 1).all()
    counts = {name: (station[found.rows] == name).sum() for name in ("rare", "b", "c")}
    assert counts["rare"] == 100 and abs(counts["b"] - counts["c"]) < 100
    again = StratifiedSample.of(poses, 1000)
    assert again is not None and np.array_equal(found.rows, again.rows)


def test_repeated_visits_are_kept_evenly_in_time() -> None:
    rng = np.random.default_rng(3)
    command = rng.permutation(np.repeat(np.arange(1000), 20))
    poses = poses_of(rng.uniform(-2, 2, (1000, 6))[command], np.arange(20_000))
    found = StratifiedSample.of(poses, 4000)
    assert found is not None
    counts = np.bincount(command[found.rows], minlength=1000)
    assert (counts > 0).sum() == 400 and set(counts) == {0, 10}
    assert abs(found.rows.mean() / 20_000 - 0.5) < 0.02


def test_commands_are_told_as_by_comparing_each_with_all_before() -> None:
    """With encoder noise about the tolerance's size, over cell borders of the look-up, in a file in any order."""
    rng = np.random.default_rng(4)
    centres = rng.uniform(-2e-3, 2e-3, (30, 3))
    number = rng.integers(0, 30, 600)
    q = centres[number] + 0.3 * SAME_COMMAND * rng.standard_normal((600, 3))
    leaders: list[int] = []
    label = np.zeros(600, dtype=int)
    for row in range(600):
        alike = [k for k, lead in enumerate(leaders) if np.abs(q[lead] - q[row]).max() <= SAME_COMMAND]
        if not alike:
            leaders.append(row)
        label[row] = alike[0] if alike else len(leaders) - 1
    expected = [np.flatnonzero(label == k) for k in range(len(leaders))]
    found = visit_statistics(poses_of(q, np.arange(600)))
    assert [pose.rows.tolist() for pose in found] == [rows.tolist() for rows in expected if len(rows) > 1]


def test_a_payload_measured_at_every_pose_is_no_stratum() -> None:
    """As from a load cell; a declared set of payloads is one."""
    rng = np.random.default_rng(5)
    poses = poses_of(rng.uniform(-2, 2, (50_000, 6)), np.arange(50_000))
    measured = StratifiedSample.of(replace(poses, payload=rng.normal(5.0, 0.1, 50_000)), 1000)
    assert measured is not None and len(measured.rows) == 1000
    changed = StratifiedSample.of(replace(poses, payload=np.where(np.arange(50_000) < 500, 5.0, 0.0)), 1000)
    assert changed is not None and (changed.rows < 500).sum() == 100


def test_many_stations_take_no_more_visits_than_others() -> None:
    rng = np.random.default_rng(6)
    command = np.tile(np.arange(2000), 20)
    station = np.array([f"s{k}" for k in range(40)])[command % 40]
    poses = poses_of(rng.uniform(-2, 2, (2000, 6))[command], np.arange(40_000), station=station)
    found = StratifiedSample.of(poses, 4000)
    assert found is not None and len(found.rows) <= 4400
    assert len(np.unique(station[found.rows])) == 40
