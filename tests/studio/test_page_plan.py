"""The Plan page: motions against limits, checks of poses, and the page itself."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import studio
from page_elements import WAIT

from flexcal.data.plans import FourierPaths, PosePlan, TrajectoryPlan, write_plan
from flexcal.model.robot import RobotModel
from flexcal.studio.project import Project
from flexcal.studio.steps.measure.next_pose import NextPose
from flexcal.studio.steps.measure.pose_card import pose_card
from flexcal.studio.steps.plan.plan_files import plan_files
from flexcal.studio.steps.plan.planned_motion import MotionJudge, limit_sentence, trajectory_motions
from flexcal.studio.steps.plan.pose_checks import PoseChecks

EXAMPLE = Path(__file__).parents[2] / "examples" / "tx90l"
FOLDED = np.array([0.0, 2.2, 2.4, 0.0, 0.0, 0.0])
STRETCHED = np.array([0.0, 0.4, 0.6, 0.0, 0.5, 0.0])


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False)


def _without_shapes(folder: Path) -> RobotModel:
    shutil.copytree(EXAMPLE, folder / "bare")
    urdf = folder / "bare" / "tx90l.urdf"
    urdf.write_text(re.sub(r"<collision.*?</collision>", "", urdf.read_text(), flags=re.DOTALL))
    return RobotModel.from_yaml(folder / "bare" / "robot.yaml", estimates=False)


def plan_of(amplitude: float) -> TrajectoryPlan:
    sine = np.zeros((1, 6, 1))
    sine[0, 1, 0] = amplitude
    paths = FourierPaths(STRETCHED[None], sine, np.zeros((1, 6, 1)))
    return TrajectoryPlan(
        name="test", paths=paths, payload=0.0, base_frequency_hz=0.5, periods=2, settle_periods=1, rate_hz=100.0, torque="held", seed=0
    )  # fmt: skip


def test_torques_of_a_motion_are_those_of_pinocchio(model: RobotModel) -> None:
    """Away from reversals: links by the recursive Newton-Euler algorithm, rotors and friction as robot.yaml has them."""
    import pinocchio as pin

    plan = plan_of(1.0)
    motion = trajectory_motions(MotionJudge(model, 0.0), plan)["1"]
    robot: Any = pin.buildModelFromUrdf(str(model.urdf))
    data = robot.createData()
    q, dq, ddq = plan.motion(0, motion.time)
    efforts = np.array([joint.effort for joint in model.joints])
    for k in np.flatnonzero(np.abs(dq[:, 1]) > 0.8)[::40]:
        expected = pin.rnea(robot, data, q[k], dq[k], ddq[k])[1]
        drives = model.drives
        expected += drives.rotor_inertia[1] * ddq[k, 1] + drives.viscous[1] * dq[k, 1]
        expected += drives.coulomb[1] * np.sign(dq[k, 1])
        assert motion.shares["torque"][k, 1] * efforts[1] == pytest.approx(expected, rel=1e-4)


def test_a_motion_beyond_a_limit_is_told_with_joint_and_share(model: RobotModel) -> None:
    judge, fastest = MotionJudge(model, 0.0), model.joints[1].velocity
    good, kept = limit_sentence(trajectory_motions(judge, plan_of(0.3)), "trajectory")
    assert kept and "All limits" in good
    bad, kept = limit_sentence(trajectory_motions(judge, plan_of(1.25 * fastest)), "trajectory")
    assert not kept and re.search(r"joint_2 takes 125 % of its velocity limit in trajectory 1", bad)


def test_colliding_pose_is_named(model: RobotModel) -> None:
    checks = PoseChecks.of(model, np.array([STRETCHED, FOLDED]))
    assert checks.collides.tolist() == [False, True] and checks.touching(1) and not checks.touching(0)
    assert checks.words(1).startswith("collides")
    assert "Pose 2" in checks.sentences()[0][0]


def test_poses_of_a_robot_without_collision_shapes_are_not_called_good(tmp_path: Path) -> None:
    """Folded onto its base, and with the tool below it: told from the capsules that are drawn, and from heights by Pinocchio."""
    import pinocchio as pin

    model = _without_shapes(tmp_path)
    low = np.array([0.0, 1.9, 0.6, 0.0, 0.0, 0.0])
    folded = np.array([0.0, -2.5, -2.5, 0.0, 0.5, 0.0])
    checks = PoseChecks.of(model, np.array([STRETCHED, low, folded]))
    robot: Any = pin.buildModelFromUrdf(str(model.urdf))
    data = robot.createData()
    for row, q in enumerate(checks.q):
        pin.forwardKinematics(robot, data, q)
        lowest = min(float(data.oMi[k].translation[2]) for k in range(1, 7))
        assert checks.below[row] == (min(lowest, checks.targets[row, 2]) < 0)
    assert not checks.collides.any() and checks.words(0) == "not checked"
    assert checks.below.tolist()[:2] == [False, True] and "below the base plane" in checks.words(1)
    assert re.search("not checked; look: links of base and joint_4 close", checks.words(2))
    assert "not checked" in checks.sentences()[0][0]
    shown = pose_card(model, NextPose(2, low), "")
    assert "Collisions are not checked" in shown and "below the base plane" in shown
    assert "below the base plane" not in pose_card(model, NextPose(1, STRETCHED), "")


def test_robot_with_collision_shapes_gets_no_reserve(model: RobotModel) -> None:
    checks = PoseChecks.of(model, STRETCHED[None])
    assert checks.words(0) == "good" and not checks.looks(0)
    assert "not checked" not in pose_card(model, NextPose(1, STRETCHED), "")


def test_plans_are_found_by_kind(tmp_path: Path) -> None:
    write_plan(tmp_path / "poses.yaml", PosePlan(q=np.zeros((2, 6))))
    write_plan(tmp_path / "trajectory.yaml", plan_of(0.3))
    (tmp_path / "broken.yaml").write_text("kind: poses\nq: what\n")
    project = Project.open(tmp_path)
    assert plan_files(project, "poses") == ["poses.yaml"]
    assert plan_files(project, "trajectory") == ["trajectory.yaml"]


def test_page_shows_collisions_and_runs_the_verb(page: Any, tmp_path: Path) -> None:
    """A colliding pose of the folder is named; random poses are drawn by the command line that is shown."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "arm"
    shutil.copytree(EXAMPLE, folder)
    write_plan(folder / "poses.yaml", PosePlan(q=np.array([STRETCHED, FOLDED])))
    with studio(folder) as running:
        page.goto(running.url)
        page.get_by_text("2 Plan").click(timeout=WAIT)
        page.get_by_text("Pose 2: bodies are in contact").wait_for(timeout=WAIT)
        page.get_by_text("pose 2", exact=True).click()
        page.get_by_text(re.compile("Pose 2: .* touch")).wait_for(timeout=WAIT)
        page.get_by_label("What to plan").last.click()
        page.get_by_role("option", name="Poses to verify on").click()
        page.get_by_text("--random --count 20 --seed 7 --out others.yaml").first.wait_for(timeout=WAIT)
        page.get_by_role("button", name="Draw random poses").click()
        page.get_by_text("20 random poses, for a verification").wait_for(timeout=WAIT)
    assert (folder / "others.yaml").is_file()


def test_empty_number_is_told_and_a_plan_has_no_tally(page: Any, tmp_path: Path) -> None:
    """An emptied field plans its last number, which is said; of the plan no count of good checks is shown, nor that collisions are none."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    _without_shapes(tmp_path)
    folder = tmp_path / "bare"
    with studio(folder) as running:
        page.goto(running.url)
        page.get_by_text("2 Plan").click(timeout=WAIT)
        number = page.get_by_label("Number of poses").last
        number.fill("12", timeout=WAIT)
        page.get_by_text("Plans 12 poses, also where the field is left empty.").wait_for(timeout=WAIT)
        number.fill("")
        page.get_by_role("button", name="Plan poses").click()
        page.get_by_text("12 poses to measure").wait_for(timeout=WAIT)
        shown = page.locator("body").inner_text()
        assert "checks are good" not in shown and "There are" not in shown
        assert "Collisions are not checked: the URDF has no collision shapes." in shown
        page.get_by_text("pose 1", exact=True).wait_for()
        assert "not checked" in page.locator("body").inner_text()
