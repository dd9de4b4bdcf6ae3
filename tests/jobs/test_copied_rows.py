"""Copies among measured poses are recognised, said and left out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexcal import PoseSet, RobotModel, calibrate, read_poses
from flexcal.data.poses import concatenate
from flexcal.jobs.calibration.copied_rows import distinct_rows


@pytest.fixture
def poses(ur5: RobotModel, examples: Path) -> PoseSet:
    """60 measured poses, all different."""
    return read_poses(examples / "ur5_tracker" / "grid.csv", ur5).subset(slice(0, 960, 16))


def test_five_times_the_same_rows_are_those_rows(ur5: RobotModel, poses: PoseSet) -> None:
    """Copies with other numbers of poses, in another order, and as of labels that are held out too."""
    assert distinct_rows(poses).all()
    mixed = np.random.default_rng(1).permutation(np.repeat(np.arange(60), 5))
    five = replace(poses.subset(mixed), pose=np.arange(300))
    kept = distinct_rows(five)
    assert kept.sum() == 60 and (np.sort(mixed[kept]) == np.arange(60)).all()
    once = calibrate(ur5, five.subset(kept), terms=["kinematic"])
    again = calibrate(ur5, five, terms=["kinematic"], hold_out=("cell", (mixed % 2).astype(str)))
    assert again.estimate.values == once.estimate.values
    assert "left out: 240 rows of 300, which are copies" in again.summary()


def test_second_visits_are_no_copies(poses: PoseSet) -> None:
    """The same commands, read again: of fine digits never the same, of coarse ones by chance."""
    rng = np.random.default_rng(2)
    for digits, scatter in ((7, 1e-5), (5, 1e-5), (4, 4e-5)):
        visits = concatenate([poses] * 3)
        read = np.round(visits.position + scatter * rng.normal(size=(180, 3)), digits)
        assert distinct_rows(replace(visits, position=read)).all(), digits


def test_another_payload_temperature_or_point_is_no_copy(poses: PoseSet) -> None:
    twice = concatenate([poses] * 2)
    other = np.repeat([0.0, 1.0], 60)
    assert distinct_rows(twice).sum() == 60
    for change in ({"payload": other}, {"temperature": 20 + other}, {"station": np.repeat(["a", "b"], 60)}):
        assert distinct_rows(replace(twice, **change)).all()
