"""What the page says of rows once later ones came, and of planned poses that have a row."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from waiting import until

from flexcal import PosePlan, RobotModel, VirtualCell
from flexcal.data.plans import write_plan
from flexcal.design.poses import random_candidates
from flexcal.design.scene import CollisionChecker, MeasuringSetup
from flexcal.studio.project import Choices, Project
from flexcal.studio.steps.measure.guide import Answer
from flexcal.studio.steps.measure.measuring import Measuring
from flexcal.studio.steps.measure.pose_list import pose_list
from flexcal.studio.steps.measure.sentences import next_text, outlook_text
from flexcal.virtual_cell import CellConfig

EXAMPLE = Path(__file__).parents[2] / "examples" / "tx90l"
COUNT = 24


@pytest.fixture(scope="module")
def measured() -> tuple[RobotModel, np.ndarray, np.ndarray]:
    """The robot, and poses (N, 6) with their points (N, 3), m, in the virtual cell."""
    model = RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False)
    setup = MeasuringSetup.declared(model, None, None)
    q = random_candidates(CollisionChecker(model), COUNT, np.random.default_rng(3), setup)[:COUNT]
    return model, q, VirtualCell.drawn(model, CellConfig(), 1)[0].measure(PosePlan(q=q)).position


def lines(q: np.ndarray, points: np.ndarray) -> list[dict[str, str]]:
    return [
        {"pose": str(k + 1)}
        | {f"q{i + 1}": repr(float(v)) for i, v in enumerate(q[k])}
        | dict(zip("xyz", map(repr, points[k].tolist()), strict=True))
        for k in range(len(q))
    ]


def judged(folder: Path, model: RobotModel, q: np.ndarray, rows: list[dict[str, str]]) -> Measuring:
    """A measurement with a plan of poses `q` whose rows are all judged."""
    for name in ("robot.yaml", "tx90l.urdf"):
        shutil.copy(EXAMPLE / name, folder / name)
    write_plan(folder / "poses.yaml", PosePlan(q=q))
    answers: list[Answer] = []
    measuring = Measuring(Project.open(folder), Choices.read(folder), lambda: model, answers.append)
    measuring.load()
    measuring.take(rows)
    settle(measuring, answers)
    return measuring


def settle(measuring: Measuring, answers: list[Answer]) -> None:
    def settled() -> bool:
        for answer in list(answers):
            measuring.answered(answer)
        return measuring.outlook is not None and len(measuring.judgements) >= measuring.series.used.sum()

    until(settled)


def test_poses_with_good_rows_are_complete(
    tmp_path: Path, measured: tuple[RobotModel, np.ndarray, np.ndarray]
) -> None:
    model, q, points = measured
    measuring = judged(tmp_path, model, q, lines(q, points))
    assert measuring.reached == COUNT and measuring.is_complete
    assert f"all {COUNT} planned poses are measured" in next_text(measuring, None)
    measuring.exclude(5, "bumped")
    assert f"{COUNT - 1} of {COUNT} planned poses are measured, 1 are" in next_text(measuring, None)


def test_rows_in_millimetres_are_not_measured_poses(
    tmp_path: Path, measured: tuple[RobotModel, np.ndarray, np.ndarray]
) -> None:
    model, q, points = measured
    measuring = judged(tmp_path, model, q, lines(q, 1000 * points))
    assert measuring.is_complete and measuring.reached == 0
    text = next_text(measuring, None)
    assert f"{COUNT} rows, none of them a good one" in text and "are measured" not in text


def test_rows_at_other_joint_positions_are_not_at_planned_poses(
    tmp_path: Path, measured: tuple[RobotModel, np.ndarray, np.ndarray]
) -> None:
    model, q, points = measured
    planned = q.copy()
    planned[:, 3] += 0.1
    measuring = judged(tmp_path, model, planned, lines(q, points))
    following = measuring.following(None)
    assert not measuring.is_complete and following is not None and following.number == 1
    assert f"{COUNT} rows, none at a planned pose" in next_text(measuring, following)


def test_a_row_that_is_found_wrong_later_says_so_and_gives_the_reason(
    tmp_path: Path, measured: tuple[RobotModel, np.ndarray, np.ndarray]
) -> None:
    """The third row came before rows could be judged."""
    model, q, points = measured
    wrong = points.copy()
    wrong[2] += [0.0, 0.4, 0.0]
    measuring = judged(tmp_path, model, q, lines(q, wrong))
    assert measuring.answer is not None and measuring.answer.judgements[2].code == "too_early"
    judgement = measuring.judgements[2]
    assert judgement.code == "outlier" and judgement.error == pytest.approx(0.4, abs=0.01)
    listed = pose_list(measuring.series, measuring.judgements, None, frozenset(), None, height="1em")
    assert listed.count("✗ outlier") == 1
    assert judgement.sentence in (outlook_text(measuring) or "")
    assert measuring.exclude(2, "") == judgement.sentence and "exclude it" in judgement.sentence
