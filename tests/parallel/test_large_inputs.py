"""Many logs, candidates and poses of a map in blocks: on Dask as in this process, and near what all at once give."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from flexcal.design.optimality import exchange_on_shortlist
from flexcal.design.poses import criterion_named, pose_candidates, tool_error
from flexcal.design.scene import MeasuringSetup
from flexcal.dynamics.estimators import OLS
from flexcal.dynamics.signals import JointLog
from flexcal.files.formats import to_plain
from flexcal.jobs.accuracy import map_accuracy, volume_map
from flexcal.jobs.calibration import calibrate_robot
from flexcal.jobs.dynamics import identify_dynamics
from flexcal.jobs.experiments import PoseRequest, PoseRequestFiles, candidate_poses, plan_calibration_poses
from flexcal.jobs.logs import hold_out
from flexcal.jobs.logs.worker_logs import present_log
from flexcal.model.robot import DynamicsConfig, RobotModel

LOGS = 5


@pytest.fixture(scope="module")
def tx40(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[RobotModel, list[Path]]:
    """The robot, and its log in parts that follow each other."""
    folder = Path(shutil.copytree(examples / "tx40", tmp_path_factory.mktemp("logs") / "tx40"))
    table = pl.read_parquet(folder / "exciting.parquet")
    rows = len(table) // LOGS
    paths = [folder / f"part_{number}.parquet" for number in range(LOGS)]
    for number, path in enumerate(paths):
        table[number * rows : (number + 1) * rows].write_parquet(path)
    model = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    settings = DynamicsConfig(cutoff_hz=100.0, decimation=20, friction="classic")
    return replace(model, config=replace(model.config, dynamics=settings)), paths


@pytest.mark.parametrize("most", [hold_out.MOST_EXPERIMENTS, 2])
def test_logs_on_dask_give_the_same_estimate(
    tx40: tuple[RobotModel, list[Path]], dask_address: str, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hold_out, "MOST_EXPERIMENTS", most)
    model, logs = tx40
    here = identify_dynamics(model, logs[:-1], validate=logs[-1:])
    there = identify_dynamics(model, logs[:-1], validate=logs[-1:], on=dask_address)
    assert len(there.train.batches) == min(most, LOGS - 1)
    one, other = here.estimate, there.estimate
    np.testing.assert_array_equal(other.parameters.coordinates(), one.parameters.coordinates())
    np.testing.assert_array_equal(other.covariance, one.covariance)
    assert here.document()["error_percent"] == there.document()["error_percent"]
    for mine, same in zip(here.predictions, there.predictions, strict=True):
        np.testing.assert_array_equal(mine.predicted, same.predicted)


def test_logs_in_groups_have_the_same_least_squares(
    tx40: tuple[RobotModel, list[Path]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With equal weights the tree of factors is a factorisation of all rows."""
    model, logs = tx40
    apart = identify_dynamics(model, logs, estimator=OLS())
    monkeypatch.setattr(hold_out, "MOST_EXPERIMENTS", 2)
    joined = identify_dynamics(model, logs, estimator=OLS())
    assert (len(apart.train.subsystems), len(joined.train.subsystems)) == (6 * LOGS, 6 * 2)
    np.testing.assert_allclose(
        joined.estimate.parameters.coordinates(),
        apart.estimate.parameters.coordinates(),
        rtol=1e-9,
        atol=1e-9,
    )


def test_a_log_is_filtered_again_where_its_file_is_not(
    tx40: tuple[RobotModel, list[Path]], tmp_path: Path
) -> None:
    model, logs = tx40
    log = JointLog.read(logs[0], model, 100.0, tmp_path)
    with present_log(log, model) as there:
        assert there is log
        expected = list(there.blocks())
    log.filtered.unlink()
    with present_log(log, model) as again:
        found = list(again.blocks())
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one.ddq, other.ddq)
    assert not again.filtered.exists()


@pytest.fixture(scope="module")
def ur5(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """robot.yaml of a calibrated robot."""
    folder = tmp_path_factory.mktemp("robots") / "ur5"
    shutil.copytree(examples / "ur5_tracker", folder)
    points = pl.read_csv(folder / "grid.csv", comment_prefix="#")
    points[::13].write_csv(folder / "few.csv")
    calibrate_robot(folder / "robot.yaml", [folder / "few.csv"], terms=["kinematic"])
    return folder / "robot.yaml"


def test_candidates_in_blocks(
    ur5: Path, dask_address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On Dask as here; better than one block alone, at most 1 % worse than all candidates at once; and the bound is below all."""
    total, count, block = 6000, 20, 1000
    monkeypatch.setattr(candidate_poses, "BLOCK", block)
    request, nothing = PoseRequest(count=count, candidates=total), PoseRequestFiles()
    here = plan_calibration_poses(ur5, tmp_path / "here.yaml", request, nothing)
    there = plan_calibration_poses(ur5, tmp_path / "there.yaml", request, nothing, on=dask_address)
    np.testing.assert_array_equal(there.plan.q, here.plan.q)
    document = here.document()
    assert document["candidates"] == total
    assert document == there.document() | {key: document[key] for key in ("plan", "provenance", "command")}
    one = plan_calibration_poses(ur5, tmp_path / "one.yaml", replace(request, candidates=block), nothing)
    assert here.design.tool_error < one.design.tool_error
    assert here.design.least_possible <= one.design.least_possible

    model = RobotModel.from_yaml(ur5)
    rng = np.random.default_rng(5)
    all_at_once = pose_candidates(model, rng=rng, candidates=total, setup=MeasuringSetup.declared(model))
    weight, sensitivity = all_at_once.tool_error_weight, all_at_once.base.sensitivity
    chosen = exchange_on_shortlist(sensitivity, count, criterion_named("c", weight)).chosen
    best = tool_error(all_at_once.base, weight, chosen)
    # other candidates, other working poses: what differs by these is less than what the blocks may lose
    assert here.design.tool_error < 1.01 * best
    assert here.design.least_possible < here.design.tool_error


def test_a_map_in_blocks(
    ur5: Path, dask_address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On Dask as here; quantiles against those of the table's columns."""
    monkeypatch.setattr(volume_map, "BLOCK", 300)
    count = 1000
    here = map_accuracy(ur5, tmp_path / "here.parquet", count=count)
    there = map_accuracy(ur5, tmp_path / "there.parquet", count=count, on=dask_address)
    table, other = (pl.read_parquet(tmp_path / f"{name}.parquet") for name in ("here", "there"))
    assert table.equals(other) and len(table) == count and table["q1"].n_unique() == count
    document = here.document()
    for key in ("poses", "predicted", "worst", "sources"):
        assert to_plain(there.document()[key]) == to_plain(document[key])
    for name in ("mean", "p95", "uncalibrated"):
        values = np.sort(table[f"{name}_mm"].to_numpy())
        for share, key in ((0.5, "median_mm"), (0.9, "p90_mm")):
            # between neighbours of the quantile, within a thousandth
            low, high = (values[int(share * (count - 1)) + step] for step in (0, 1))
            assert low * (1 - 1.001e-3) <= document["predicted"][name][key] <= high * (1 + 1.001e-3)
        assert document["predicted"][name]["worst_mm"] == pytest.approx(values[-1], rel=1e-12)
    worst = document["worst"][0]
    assert worst["p95_mm"] == pytest.approx(table["p95_mm"].max(), rel=1e-12)
    whole = map_accuracy(ur5, tmp_path / "few.html", count=300)
    assert whole.document()["quantile_error_percent"] == 0.0 and whole.whole is None
