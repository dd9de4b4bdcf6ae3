"""The page beside a plan of poses: what it warns of, and what its figures show."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from flexcal.model.kinematics import joint_origins, point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.report.figures import joint_positions, links_at, plan_space, pose_numbers
from flexcal.report.pages import PoseStudy
from flexcal.report.pages.pose_design import pose_checks, pose_page

ORIGIN = {"provenance": {"input.robot.yaml": "0123"}, "command": "flexcal design poses robot.yaml"}


def _results(positive: int, blocked: list[list[int]], reached: float) -> dict:
    return {
        "plan": "plan.yaml",
        "seed": 3,
        "poses": 20,
        "instrument": "a laser tracker",
        "tool_error_mm": 0.03,
        "least_possible_mm": 0.025,
        "working": {"poses": 200, "reached_share": reached, "box_m": None},
        "flanks": {"joint_2": {"positive": positive, "negative": 20 - positive}},
        "moves_s": 12.3,
        "blocked_moves": blocked,
        "curve": [{"poses": n, "tool_error_mm": 0.1 / n, "random_mm": 0.2 / n} for n in (10, 20, 40)],
        **ORIGIN,
    }


@pytest.mark.parametrize(
    ("positive", "blocked", "reached", "statuses"),
    [
        (9, [], 1.0, ["good", "good", "good"]),
        (2, [], 1.0, ["care", "good", "good"]),
        (9, [[3, 4]], 0.5, ["good", "care", "care"]),
    ],
)
def test_what_it_warns_of(positive: int, blocked: list, reached: float, statuses: list[str]) -> None:
    checks = pose_checks(_results(positive, blocked, reached))
    assert [check.status for check in checks] == statuses
    assert ("from 3 to 4" in checks[-1].answer) == bool(blocked)


def test_without_collision_shapes_nothing_is_said_to_be_free_of_collisions(
    tx90l: RobotModel, tmp_path: Path, rng: np.random.Generator
) -> None:
    shutil.copytree(tx90l.path.parent, tmp_path / "bare")
    urdf = tmp_path / "bare" / tx90l.urdf.name
    urdf.write_text(re.sub(r"<collision.*?</collision>", "", urdf.read_text(), flags=re.DOTALL))
    bare = RobotModel.from_yaml(tmp_path / "bare" / tx90l.path.name, estimates=False)
    q = rng.uniform(-1, 1, (20, 6))
    moves = pose_page(PoseStudy(bare, q, _results(9, [], 1.0))).verdict.checks[-1]
    assert moves.status == "unknown" and moves.answer.startswith("Not checked")
    low = pose_page(PoseStudy(bare, q, _results(9, [[3, 4]], 1.0))).verdict.checks[-1]
    assert low.status == "care" and "below the base plane" in low.answer and "not checked" in low.answer
    drawn = {"plan": "r.yaml", "seed": 1, "poses": 20, **ORIGIN}
    assert "collisions are not checked" in pose_page(PoseStudy(bare, q, drawn)).verdict.sentence
    assert "free of collisions" in pose_page(PoseStudy(tx90l, q, drawn)).verdict.sentence


def test_first_screen_and_figures(tx90l: RobotModel, rng: np.random.Generator) -> None:
    q = rng.uniform(-1, 1, (20, 6))
    page = pose_page(PoseStudy(tx90l, q, _results(9, [], 1.0)))
    assert [fact.value for fact in page.verdict.facts] == ["0.0300", "≤ 20", "12"]
    assert [figure.id for figure in page.figures] == ["figure-numbers", "figure-space", "figure-joints"]
    drawn = pose_page(PoseStudy(tx90l, q, {"plan": "r.yaml", "seed": 1, "poses": 20, **ORIGIN}))
    assert drawn.verdict.facts == () and len(drawn.figures) == 2


def test_space_shows_the_targets_in_order_and_the_box(tx90l: RobotModel, rng: np.random.Generator) -> None:
    q = rng.uniform(-1, 1, (5, 6))
    box = np.array([[0.4, -0.3, 0.2], [0.9, 0.3, 0.8]])
    figure = plan_space(joint_origins(tx90l, q), links_at(tx90l, q[:1])[0], box, box, np.array([2.5, 0, 1]))
    traces = {trace.name: trace for trace in figure.plotly().data}
    target = traces["target"]
    there = point_kinematics(tx90l, q, jacobians=False).position
    np.testing.assert_allclose(np.stack([target.x, target.y, target.z], axis=1), there, atol=1e-6)
    edges = np.stack([traces["working volume"][axis] for axis in "xyz"], axis=1).reshape(12, 3, 3)
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    np.testing.assert_allclose(sorted(lengths), [0.5] * 4 + [0.6] * 8, rtol=1e-5)


def test_joints_stand_between_their_limits(tx90l: RobotModel) -> None:
    ends = np.array([[joint.lower for joint in tx90l.joints], [joint.upper for joint in tx90l.joints]])
    marks = [trace for trace in joint_positions(tx90l, ends).plotly().data if trace.mode == "markers"]
    np.testing.assert_allclose([trace.x for trace in marks], [[0, 1]] * 6, atol=1e-6)


def test_the_curve_and_its_marks() -> None:
    figure = pose_numbers([1, 2], {"a": [0.2, 0.1], "b": [0.3, 0.2]}, 2, 0.15)
    assert [trace.name for trace in figure.plotly().data] == ["a", "b"] and len(
        figure.plotly().layout.shapes
    ) == 2
