"""Drift of AP and RP on visits worked out by hand, and how often chance is taken for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexcal.calibration.accuracy import PoseDrift, common_displacement, pose_drifts, visit_statistics
from flexcal.data.poses import PoseSet

MM = 1e-3


def visits(points: np.ndarray, time: np.ndarray | None) -> PoseSet:
    """Cycles (C, P, 3) of points at as many poses, in the order of measuring."""
    cycles, poses = points.shape[:2]
    q = np.tile(np.linspace(0.1, 1.0, poses)[:, None], (cycles, 2))
    size = len(q)
    return PoseSet(
        q=q, position=points.reshape(-1, 3), sigma=np.full((size, 3), 1e-5), torque=None, payload=None,
        target=np.full(size, "smr"), station=np.full(size, "tracker"), temperature=None,
        pose=np.tile(np.arange(1, poses + 1), cycles), time=time,
    )  # fmt: skip


def drifts(points: np.ndarray, time: np.ndarray | None) -> list[PoseDrift]:
    poses = visits(points, time)
    return pose_drifts(poses, visit_statistics(poses))


def test_a_pose_that_goes_sideways_and_repeats_worse() -> None:
    """Ten visits at ±1 mm about (3, 0, 0) mm from the command, ten at ±1.5 mm about (3, 4, 0), ten at ±2 mm about (0, 5, 12).

    l is 1, 1.5 and 2 mm at every visit of a set, and so is RP; AP is 3, 5 and 13 mm: dRP = 1 mm, dAP = 10 mm, the way √(9 + 25 + 144) mm.
    """
    sides = np.tile([[0, 0, 1.0], [0, 0, -1.0]], (5, 1))
    centres = np.array([[3.0, 0, 0], [3, 4, 0], [0, 5, 12]])
    sets = [centre + size * sides for centre, size in zip(centres, (1.0, 1.5, 2.0), strict=True)]
    command = np.array([1.0, 2.0, 3.0])
    points = command + MM * np.concatenate(sets)
    (found,) = drifts(points[:, None], 60.0 * np.arange(30))
    np.testing.assert_allclose(found.repeatability, MM * np.array([1.0, 1.5, 2.0]), rtol=1e-9)
    errors = points - command
    np.testing.assert_allclose(found.accuracy(errors), MM * np.array([3.0, 5.0, 13.0]), rtol=1e-9)
    assert found.repeatability_drift == pytest.approx(1.0 * MM, rel=1e-9)
    assert found.accuracy_drift(errors) == pytest.approx(10.0 * MM, rel=1e-9)
    assert found.distance == pytest.approx(MM * np.sqrt(178.0), rel=1e-9)
    np.testing.assert_allclose(found.time, [270.0, 870.0, 1470.0])


def test_what_all_poses_do_together() -> None:
    """Two poses go (2, 1, 0) and (2, -1, 0) mm: (2, 0, 0) together, and 1 mm each besides."""
    scatter = 1e-6 * np.random.default_rng(2).normal(size=(20, 2, 3))
    moved = np.zeros((20, 2, 3))
    moved[10:] = MM * np.array([[2.0, 1, 0], [2, -1, 0]])
    found = drifts(scatter + moved, np.arange(40.0))
    np.testing.assert_allclose(common_displacement(found), (2 * MM, 1 * MM), atol=2e-6)
    assert all(drift.certain for drift in found)


def test_sets_take_every_visit_once() -> None:
    points = np.random.default_rng(3).normal(size=(37, 2, 3))
    found = drifts(points, np.arange(74.0))
    for pose, drift in enumerate(found):
        assert [len(rows) for rows in drift.sets] == [13, 12, 12]
        np.testing.assert_array_equal(np.concatenate(drift.sets), np.arange(pose, 74, 2))


def test_without_a_clock_or_enough_visits_nothing_is_known() -> None:
    points = np.random.default_rng(4).normal(size=(20, 1, 3))
    assert len(drifts(points, np.arange(20.0))) == 1
    assert drifts(points, None) == []
    assert drifts(points[:19], np.arange(19.0)) == []
    assert drifts(points, np.concatenate([np.arange(10.0), np.arange(10.0)])) == []


def test_chance_is_as_often_as_it_says() -> None:
    """Of poses that stay, the probability is uniform: its quantiles, by the central limit of 2000 draws, lie within 3.5 σ."""
    rng = np.random.default_rng(5)
    mixed = np.array([[1.0, 0, 0], [0.8, 0.3, 0], [0, 0.1, 0.05]])
    points = 1e-5 * rng.normal(size=(23, 2000, 3)) @ mixed.T
    poses = visits(points, np.arange(23 * 2000.0))
    rows = np.arange(23 * 2000).reshape(23, 2000).T
    pattern = visit_statistics(poses.subset(rows[0]))[0]
    chances = np.array([d.chance for d in pose_drifts(poses, [replace(pattern, rows=own) for own in rows])])
    for level in (0.05, 0.3, 0.7):
        spread = np.sqrt(level * (1 - level) / 2000)
        assert abs((chances < level).mean() - level) < 3.5 * spread


def test_points_without_scatter() -> None:
    still = np.ones((20, 1, 3))
    assert drifts(still, np.arange(20.0))[0].chance == 1.0
    moved = still.copy()
    moved[10:, 0, 1] += 1e-3
    assert drifts(moved, np.arange(20.0))[0].certain
