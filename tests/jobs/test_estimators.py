"""The names of the estimators, and one that refuses a recording."""

import shutil
from pathlib import Path
from typing import get_args, get_type_hints

from refusals import refused

from flexcal.cli.verbs.identify_dynamics import IdentifyDynamics
from flexcal.dynamics.estimators import ESTIMATORS, EstimatorName
from flexcal.jobs.dynamics import identify_robot_dynamics


def test_the_option_offers_every_estimator() -> None:
    offered = get_args(get_type_hints(IdentifyDynamics)["estimator"])
    assert set(offered) == set(get_args(EstimatorName)) == set(ESTIMATORS)


def test_a_motion_that_does_not_repeat_is_refused_and_nothing_written(examples: Path, tmp_path: Path) -> None:
    robot = Path(shutil.copytree(examples / "tx40", tmp_path / "tx40")) / "robot.yaml"
    robot.write_text(robot.read_text().replace("decimation: 100", "decimation: 100, friction: classic"))
    before = sorted(tmp_path.rglob("*"))
    with refused("E-DYN-041", "no periodic motion"):
        identify_robot_dynamics(robot, [robot.parent / "exciting.parquet"], estimator="ml")
    assert sorted(tmp_path.rglob("*")) == before
