"""`design poses` where the robot will work, until it is good enough, and after what was measured."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from cli_files import write_csv
from refusals import assert_refusal
from test_bad_input import refused_run

from flexcal.data.plans import PosePlan, read_plan_of
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel

SMALL = ("--count", 14, "--candidates", 150)
BOX = "--working=0.5:0.9,-0.2:0.2,0.3:0.7"


def test_a_working_volume_a_csv_plan_and_its_page(run, tx90l_folder: Path) -> None:
    robot, out = tx90l_folder / "robot.yaml", tx90l_folder / "plan.csv"
    document = run("design", "poses", robot, *SMALL, BOX, "--out", out, "--json").document
    assert document["working"]["box_m"] == [[0.5, -0.2, 0.3], [0.9, 0.2, 0.7]]
    assert document["working"]["reached_share"] > 0.9
    assert document["least_possible_mm"] <= document["tool_error_mm"]
    assert document["moves_s"] > 0 and all(b == a + 1 for a, b in document["blocked_moves"])
    page = (tx90l_folder / "plan.html").read_text()
    assert document["seed"] == 0 and "Plan plan.csv, seed 0" in page
    assert json.loads(re.search(r'id="results">(.*?)</script>', page).group(1))["poses"] == 14
    for figure in ("figure-numbers", "figure-space", "figure-joints"):
        assert f'data-specification="{figure}"' in page
    measured = tx90l_folder / "measured"
    assert run("measure", out, "--cell", "virtual", "--out", measured).status == 0
    assert (measured / "poses.csv").is_file()
    declared = robot.read_text() + "working_volume: {lower: [0.5, -0.2, 0.3], upper: [0.9, 0.2, 0.7]}\n"
    robot.write_text(declared)
    again = run("design", "poses", robot, *SMALL, "--out", out, "--json").document
    assert again["tool_error_mm"] == document["tool_error_mm"]


def test_as_few_poses_as_the_wanted_error_needs(run, tx90l_folder: Path) -> None:
    robot, out = tx90l_folder / "robot.yaml", tx90l_folder / "plan.yaml"
    arguments = ("design", "poses", robot, "--candidates", 150, "--out", out, "--json")
    document = run(*arguments, "--wanted", 0.06).document
    assert 10 <= document["poses"] < 40 and document["tool_error_mm"] <= 0.06
    (tx90l_folder / "plan.yaml").unlink(), (tx90l_folder / "plan.html").unlink()
    assert_refusal(refused_run(run, tx90l_folder, *arguments, "--wanted", 0.001), "E-DESIGN-027", "40")


def test_the_next_poses_until_enough(run, tx90l_folder: Path) -> None:
    robot, out = tx90l_folder / "robot.yaml", tx90l_folder / "next.yaml"
    first = tx90l_folder / "first.yaml"
    assert run("design", "poses", robot, *SMALL, "--out", first).status == 0
    assert run("measure", first, "--cell", "virtual", "--out", tx90l_folder / "m").status == 0
    arguments = ("design", "poses", robot, "--measured", tx90l_folder / "m" / "poses.csv", "--out", out)
    arguments = (*arguments, "--candidates", 150, "--json")
    document = run(*arguments, "--count", 3).document
    assert document["measured"] == 14 and document["poses"] == len(read_plan_of(out, PosePlan)) == 3
    errors = document["tool_error_mm"]
    assert len(errors) == 4 and np.all(np.diff(errors) < 0)
    assert (tx90l_folder / "next.html").is_file()
    two = run(*arguments, "--count", 3, "--wanted", errors[2] * 1.0001).document
    assert two["poses"] == two["stop_after"] == 2
    done = run(*arguments, "--wanted", 2 * errors[0])
    assert done.status == 0 and done.document["stop_after"] == 0 and done.document["plan"] is None
    assert not out.exists() and not (tx90l_folder / "next.html").exists()


def test_the_reflector_is_turned_towards_the_instrument(run, tx90l_folder: Path) -> None:
    robot, out = tx90l_folder / "robot.yaml", tx90l_folder / "plan.yaml"
    declared = "xyz: [0.10, 0.00, 0.15], acceptance: {axis: [1, 0, 0], half_angle: 0.9}}"
    robot.write_text(robot.read_text().replace("xyz: [0.10, 0.00, 0.15]}", declared))
    assert run("design", "poses", robot, *SMALL, "--out", out).status == 0
    for plan in (out, tx90l_folder / "random.yaml"):
        if plan != out:
            assert run("design", "poses", robot, "--random", "--count", 9, "--out", plan).status == 0
        model = RobotModel.from_yaml(robot)
        motion = point_kinematics(model, read_plan_of(plan, PosePlan).q, jacobians=False)
        towards = np.array([2.5, 0, 1]) - motion.position
        cosine = np.sum(motion.orientation[:, :, 0] * towards, axis=1) / np.linalg.norm(towards, axis=1)
        assert np.all(np.arccos(cosine) <= 0.9)


@pytest.mark.parametrize(
    ("options", "refusal"),
    [
        (["--working=0.5:0.9,0:0.2"], ["E-RUN-037"]),
        (["--working=0.9:0.5,-0.2:0.2,0.3:0.7"], ["E-DESIGN-032"]),
        (["--working=5:6,5:6,0:1"], ["E-DESIGN-033"]),
        (["--working=nowhere.csv"], ["E-FILE-001", "nowhere.csv"]),
        (["--wanted", "0"], ["E-CLI-022", "0"]),
        (["--count", "9", "--criterion", "E"], ["E-DESIGN-026", "9", "29"]),
        (["--count", "2"], ["E-DESIGN-026", "2", "3"]),
        (["--random", "--measured", "poses.csv"], ["E-CLI-024"]),
    ],
)
def test_bad_options(run, tx90l_folder: Path, options: list[str], refusal: list[str]) -> None:
    arguments = ("design", "poses", tx90l_folder / "robot.yaml", "--candidates", 100, *options)
    assert_refusal(refused_run(run, tx90l_folder, *arguments, "--out", tx90l_folder / "plan.yaml"), *refusal)


def test_a_pool_in_which_no_pose_is_seen(run, tx90l_folder: Path) -> None:
    robot = tx90l_folder / "robot.yaml"
    declared = "xyz: [0.10, 0.00, 0.15], acceptance: {axis: [0, 0, 1], half_angle: 0.001}}"
    robot.write_text(robot.read_text().replace("xyz: [0.10, 0.00, 0.15]}", declared))
    rows = np.column_stack([np.arange(50), np.random.default_rng(1).uniform(-1, 1, (50, 6))])
    file = write_csv(tx90l_folder / "taught.csv", ["pose", *(f"q{i}" for i in range(1, 7))], rows)
    arguments = ("design", "poses", robot, "--from", file, "--out", tx90l_folder / "plan.yaml")
    assert_refusal(refused_run(run, tx90l_folder, *arguments), "E-DESIGN-022", "50")
    drawn = ("design", "poses", robot, "--candidates", 20, "--out", tx90l_folder / "plan.yaml")
    assert_refusal(refused_run(run, tx90l_folder, *drawn), "E-DESIGN-021", "visibility threw out")


def test_limits_that_cross_and_an_obstacle_around_the_base(run, tx90l_folder: Path) -> None:
    robot, urdf = tx90l_folder / "robot.yaml", tx90l_folder / "tx90l.urdf"
    arguments = ("design", "poses", robot, *SMALL, "--out", tx90l_folder / "plan.yaml")
    text = urdf.read_text()
    limit = re.search(r'<limit[^>]*lower="([^"]*)"[^>]*>', text)
    urdf.write_text(text.replace(limit[0], limit[0].replace(f'lower="{limit[1]}"', 'lower="9"'), 1))
    assert_refusal(refused_run(run, tx90l_folder, *arguments), "E-URDF-019", "joint_1")
    urdf.write_text(text)
    box = '<robot name="box"><link name="box"><collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>'
    (tx90l_folder / "box.urdf").write_text(box)
    robot.write_text(robot.read_text() + "obstacles: [box.urdf]\n")
    sentence = refused_run(run, tx90l_folder, *arguments)
    assert_refusal(sentence, "E-DESIGN-035", "box")


def test_a_working_volume_and_an_acceptance_that_are_none(run, tx90l_folder: Path) -> None:
    robot = tx90l_folder / "robot.yaml"
    text = robot.read_text()
    arguments = ("design", "poses", robot, *SMALL, "--out", tx90l_folder / "plan.yaml")
    robot.write_text(text + "working_volume: {lower: [1, 0, 0], upper: [0, 1, 1]}\n")
    assert_refusal(refused_run(run, tx90l_folder, *arguments), "E-ROBOT-021", "robot.yaml", "x")
    declared = "xyz: [0.10, 0.00, 0.15], acceptance: {axis: [0, 0, 0]}}"
    robot.write_text(text.replace("xyz: [0.10, 0.00, 0.15]}", declared))
    assert_refusal(refused_run(run, tx90l_folder, *arguments), "E-ROBOT-004")
