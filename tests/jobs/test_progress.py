"""Every stage of a job tells when it begins, how far it is, and when it ends."""

from __future__ import annotations

import shutil
from pathlib import Path

import polars as pl
import pytest

from flexcal.design.poses import CriterionName
from flexcal.dynamics.estimators import EstimatorName
from flexcal.jobs.dynamics import identify_robot_dynamics
from flexcal.jobs.experiments import PoseRequest, PoseRequestFiles, plan_calibration_poses


@pytest.mark.parametrize("criterion", ["c", "E"])
def test_design_of_poses(examples: Path, tmp_path: Path, criterion: CriterionName) -> None:
    told: dict[str, list[float]] = {}
    plan_calibration_poses(
        examples / "tx90l" / "robot.yaml",
        tmp_path / "plan.yaml",
        PoseRequest(20, criterion, candidates=200),
        PoseRequestFiles(),
        progress=lambda stage, share: told.setdefault(stage, []).append(share),
    )
    assert list(told) == ["candidates", "choosing", "how many"]
    for stage, shares in told.items():
        assert shares[0] == 0.0 and shares[-1] == 1.0 and shares == sorted(shares), stage
    assert sum(0 < share < 1 for share in told["choosing"]) >= 2


@pytest.mark.parametrize(("estimator", "passes"), [("irls", 2), ("tls", 1)])
def test_every_pass_over_the_logs(
    examples: Path, tmp_path: Path, estimator: EstimatorName, passes: int
) -> None:
    """An estimator that goes through the logs again tells of each pass how much of all logs it has seen."""
    robot = Path(shutil.copytree(examples / "tx40", tmp_path / "tx40")) / "robot.yaml"
    robot.write_text(robot.read_text().replace("decimation: 100", "decimation: 100, friction: classic"))
    log = robot.parent / "exciting.parquet"
    other = robot.parent / "other.parquet"
    pl.read_parquet(log).head(-1).write_parquet(other)
    told: list[float] = []

    def progress(stage: str, share: float) -> None:
        if stage == "estimating":
            told.append(share)

    identify_robot_dynamics(robot, [log, other], estimator=estimator, progress=progress)
    ends = [k for k, share in enumerate(told) if share == 1.0]
    assert len(ends) >= passes and ends[-1] == len(told) - 1
    for first, last in zip([0, *(k + 1 for k in ends)], ends, strict=False):
        own = told[first : last + 1]
        assert own == sorted(own) and 0.5 in own
