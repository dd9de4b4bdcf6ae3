"""One wrong reading among good ones is an outlier, whatever its size: it is named, residuals nothing else, and the verdict is the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import DHArm, postures, tracked, write_robot

from flexcal.data.poses import PoseSet
from flexcal.jobs.calibration import calibrate
from flexcal.model.robot import RobotModel

NOISE = 3e-5


@pytest.mark.parametrize(("seed", "count", "row"), [(4, 40, 10), (2, 25, 24), (3, 60, 0)])
def test_the_verdict_does_not_depend_on_its_size(seed: int, count: int, row: int, tmp_path: Path) -> None:
    """Wrong by 20 mm to 5 m, in any direction."""
    model = RobotModel.from_yaml(write_robot(tmp_path), estimates=False)
    rng = np.random.default_rng(seed)
    q = postures(rng, count)
    xyz = tracked(DHArm.made(seed).points(q), rng, NOISE)
    poses = PoseSet.unmeasured(q, "smr", "tracker", NOISE)
    verdicts, residuals = set(), []
    for size in (0.02, 0.107, 0.599, 5.0):
        wrong, direction = xyz.copy(), rng.normal(size=3)
        wrong[row] += size * direction / np.linalg.norm(direction)
        calibration = calibrate(model, replace(poses, position=wrong))
        assert calibration.estimate.outliers == (row,)
        assert not calibration.is_implausible
        verdicts.add((calibration.trust.status, calibration.trust.reasons))
        residuals.append(np.delete(calibration.residuals, row, axis=0))
    assert len(verdicts) == 1
    assert all(np.abs(left - residuals[0]).max() < NOISE / 3 for left in residuals)
