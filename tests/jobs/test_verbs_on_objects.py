"""The verbs on objects: a script does what the command line does, without robot.yaml's estimates, and gets the same."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal import (
    CalibratedRobot,
    Calibration,
    FrequencyRequest,
    PoseRequest,
    PoseSet,
    RobotModel,
    ToolTargets,
    TrajectoryRequest,
    accuracy_map,
    calibrate,
    certify,
    compensate,
    design_frequency,
    design_next_poses,
    design_poses,
    design_trajectories,
    export_robot,
    frequency_plan,
    predict,
    read_poses,
    repeatability,
    verify,
)
from flexcal.cli.main import main
from flexcal.data.poses import write_poses, write_targets
from flexcal.jobs.accuracy import certify_robot, map_accuracy, robot_repeatability, verify_robot
from flexcal.jobs.calibration import calibrate_robot
from flexcal.jobs.deployment import export_stored_robot

TERMS = ("kinematic", "gravity_compliance")


@pytest.fixture(scope="module")
def ur5(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the real UR5 and every third of its poses."""
    folder = tmp_path_factory.mktemp("ur5") / "ur5"
    shutil.copytree(examples / "ur5_tracker", folder)
    header, *rows = (folder / "grid.csv").read_text("utf-8").splitlines()
    (folder / "grid.csv").write_text("\n".join([header, *rows[::3]]) + "\n", "utf-8")
    return folder


@pytest.fixture(scope="module")
def nominal(ur5: Path) -> RobotModel:
    return RobotModel.from_yaml(ur5 / "robot.yaml", estimates=False)


@pytest.fixture(scope="module")
def calibration(ur5: Path, nominal: RobotModel) -> Calibration:
    return calibrate(nominal, read_poses(ur5 / "grid.csv", nominal), terms=TERMS)


@pytest.fixture(scope="module")
def unseen(ur5: Path, nominal: RobotModel) -> PoseSet:
    return read_poses(ur5 / "random.csv", nominal)


def numbers(document: dict) -> dict:
    """Without what only files have."""
    return {
        key: value
        for key, value in document.items()
        if key not in ("estimates", "command", "provenance", "fitted", "remarks", "verdict")
    }


def test_calibration_and_verification_are_those_of_the_command_line(
    calibration: Calibration, unseen: PoseSet, ur5: Path, tmp_path: Path
) -> None:
    stored = calibrate_robot(ur5 / "robot.yaml", [ur5 / "grid.csv"], terms=TERMS, out=tmp_path)
    assert stored.estimate.values == calibration.estimate.values
    np.testing.assert_array_equal(stored.estimate.covariance, calibration.estimate.covariance)
    assert repr(numbers(stored.document())) == repr(numbers(calibration.document()))
    again = verify_robot(ur5 / "robot.yaml", [ur5 / "random.csv"], estimates=tmp_path)
    verification = verify(calibration.robot, unseen)
    np.testing.assert_allclose(again.residuals, verification.residuals, atol=1e-12)
    assert verification.errors.mean < 1.1e-4
    assert np.linalg.norm(verification.before.registered, axis=1).mean() > 5e-4
    assert verification.fitted == () and "given to the fit" not in verification.summary()


def test_what_was_written_is_read_again(calibration: Calibration, ur5: Path, tmp_path: Path) -> None:
    calibration.write(tmp_path / "fit")
    robot = CalibratedRobot.from_yaml(ur5 / "robot.yaml", tmp_path / "fit")
    assert robot.measured == calibration.robot.measured == ("smr",)
    for name, value in calibration.model.values.items():
        assert robot.model.values[name] == pytest.approx(value, abs=1e-15, nan_ok=True), name
    assert (tmp_path / "fit" / "report.html").is_file()


def test_points_of_the_fit_are_said_in_a_verification(
    calibration: Calibration, nominal: RobotModel, ur5: Path
) -> None:
    some = read_poses(ur5 / "grid.csv", nominal).subset(slice(0, 40))
    assert verify(calibration.robot, some).fitted == ("40 of these 40 points",)


def test_a_calibrated_robot_is_not_calibrated_again(
    calibration: Calibration, nominal: RobotModel, ur5: Path
) -> None:
    with refused("E-RUN-095", "ur5"):
        calibrate(calibration.model, read_poses(ur5 / "grid.csv", nominal), terms=TERMS)


def test_compensated_commands_bring_the_tool_where_the_nominal_robot_has_it(
    calibration: Calibration, unseen: PoseSet
) -> None:
    targets = ToolTargets(pose=unseen.pose, target=unseen.target, q=unseen.q)
    compensation = compensate(calibration.robot, targets)
    assert compensation.commands.reached.all() and "20 of 20" in repr(compensation)
    commands = ToolTargets(pose=unseen.pose, target=unseen.target, q=compensation.commands.q)
    uncorrected, corrected = (predict(calibration.robot, which) for which in (targets, commands))
    desired = uncorrected.tool.position - uncorrected.beside
    np.testing.assert_allclose(corrected.tool.position, desired, atol=1e-8)
    distance = np.linalg.norm(uncorrected.beside, axis=1)
    np.testing.assert_allclose(distance, compensation.commands.before, rtol=1e-6)
    with refused("E-RUN-097"):
        predict(calibration.robot, ToolTargets(unseen.pose, unseen.target, position=unseen.position))


def test_map_is_that_of_the_command_line(
    calibration: Calibration, unseen: PoseSet, ur5: Path, tmp_path: Path
) -> None:
    calibration.write(tmp_path)
    box = np.array([[0.2, -0.3, 0.1], [0.5, 0.3, 0.5]])
    found = accuracy_map(calibration.robot, box=box, count=300, verification=unseen)
    stored = map_accuracy(
        ur5 / "robot.yaml",
        tmp_path / "map.html",
        working="0.2:0.5,-0.3:0.3,0.1:0.5",
        count=300,
        verification=[ur5 / "random.csv"],
        estimates=tmp_path,
    )
    np.testing.assert_allclose(found.predicted.p95, stored.predicted.p95, rtol=1e-9)
    inside = (found.predicted.position >= box[0]) & (found.predicted.position <= box[1])
    assert inside.all()


def test_repeatability_is_that_of_the_command_line(
    calibration: Calibration, nominal: RobotModel, unseen: PoseSet, ur5: Path, tmp_path: Path
) -> None:
    rows = np.tile(np.arange(len(unseen)), 3)
    visits = unseen.subset(rows)
    noise = 2e-5 * np.random.default_rng(0).standard_normal((len(rows), 3))
    write_poses(tmp_path / "visits.csv", replace(visits, position=visits.position + noise))
    calibration.write(tmp_path / "fit")
    stored = robot_repeatability(
        ur5 / "robot.yaml", [tmp_path / "visits.csv"], estimates=tmp_path / "fit", out=tmp_path / "out"
    )
    poses = read_poses(tmp_path / "visits.csv", nominal, require_motion=False)
    found = repeatability(nominal, poses, calibrated=calibration.robot)
    assert repr(numbers(found.document())) == repr(numbers(stored.document()))
    assert {"nominal", "calibrated"} == set(found.errors) and "RP" in repr(found)
    found.write(tmp_path / "again")
    for folder in ("out", "again"):
        assert {file.name for file in (tmp_path / folder).iterdir()} == {"results.json", "report.html"}
    assert repeatability(nominal, poses).errors.keys() == {"nominal"}


def test_certificate_is_that_of_the_command_line(
    calibration: Calibration, nominal: RobotModel, unseen: PoseSet, ur5: Path, tmp_path: Path
) -> None:
    targets = ToolTargets(pose=unseen.pose, target=unseen.target, q=unseen.q)
    commands = compensate(calibration.robot, targets).commands
    assert commands.q is not None
    shift = predict(calibration.robot, ToolTargets(unseen.pose, unseen.target, q=commands.q)).beside
    write_targets(tmp_path / "targets.csv", targets)
    write_poses(tmp_path / "after.csv", replace(unseen, q=commands.q, position=unseen.position - shift))
    calibration.write(tmp_path / "fit")
    stored = certify_robot(
        ur5 / "robot.yaml",
        tmp_path / "targets.csv",
        ur5 / "random.csv",
        tmp_path / "after.csv",
        tmp_path / "stored.html",
        estimates=tmp_path / "fit",
    )
    after = read_poses(tmp_path / "after.csv", nominal)
    certificate = certify(calibration.robot, targets, unseen, after)
    document = certificate.document()
    assert document["files"] == {} and len(stored.document()["files"]) == 6
    for key in ("before", "after", "after_refitted", "rms_mm", "targets"):
        assert repr(document[key]) == repr(stored.document()[key]), key
    page = certificate.report(tmp_path / "page.html", operator="A. Meier").read_text("utf-8")
    assert "<td>A. Meier</td>" in page and "AP at 20 targets" in repr(certificate)
    with refused("E-RUN-003", "before", "after"):
        certify(calibration.robot, targets, after, unseen)


@pytest.mark.parametrize(
    ("format", "options"),
    [("urdf", {}), ("json", {}), ("mdh", {"four_parameters": True}), ("offsets", {"keep_frames": True})],
)
def test_exports_are_those_of_the_command_line(
    calibration: Calibration, ur5: Path, tmp_path: Path, format: str, options: dict[str, bool]
) -> None:
    calibration.write(tmp_path / "fit")
    arguments = [f"--{name.replace('_', '-')}" for name in options]
    fit = ["--estimates", str(tmp_path / "fit"), "--out", str(tmp_path / "by_command")]
    assert main(["export", format, str(ur5 / "robot.yaml"), *fit, *arguments]) == 0
    exported = export_robot(calibration.robot, tmp_path / "by_script", format, **options)
    again = export_stored_robot(
        ur5 / "robot.yaml", tmp_path / "again", format, estimates=tmp_path / "fit", **options
    )
    assert (tmp_path / "again").read_bytes() == (tmp_path / "by_command").read_bytes()
    ours, theirs = exported.document(), again.document()
    assert ours["calibrated"] and ours.keys() == theirs.keys()
    assert ours["tool_error"].keys() == theirs["tool_error"].keys()
    for key in ("mean_mm", "p95_mm", "max_mm", "poses"):
        assert ours["tool_error"][key] == pytest.approx(theirs["tool_error"][key], rel=1e-6, abs=1e-9)
    assert exported.lost == again.lost and "of ur5: by_script" in repr(exported) and exported.summary()


def test_exports_that_are_none(calibration: Calibration, tmp_path: Path) -> None:
    with refused("E-RUN-099", "collada", "urdf"):
        export_robot(calibration.robot, tmp_path / "x", "collada")
    with refused("E-RUN-100", "keep_frames", "offsets"):
        export_robot(calibration.robot, tmp_path / "x", "urdf", keep_frames=True)


def test_every_result_shows_itself(calibration: Calibration, unseen: PoseSet, tmp_path: Path) -> None:
    results = [
        calibration,
        verify(calibration.robot, unseen),
        accuracy_map(calibration.robot, count=50),
        design_poses(calibration.model, PoseRequest(count=20, candidates=60)),
        design_next_poses(calibration.model, unseen, PoseRequest(count=3, candidates=60)),
    ]
    for number, result in enumerate(results):
        assert result.model.name == "ur5" and "of ur5: " in repr(result) and len(repr(result)) < 250
        assert result.headline and "<pre>" in result._repr_html_() and result.summary()
        page = result.report(tmp_path / f"{number}.html")
        assert page.read_text("utf-8").rstrip().endswith("</html>")


def test_plans_of_motions(tx90l: RobotModel, examples: Path, tmp_path: Path) -> None:
    request = TrajectoryRequest(count=1, criterion="D", searches=1, steps=2, harmonics=2)
    trajectories = design_trajectories(tx90l, request)
    assert len(trajectories.plan) == len(trajectories.timed) == 1
    poses = frequency_plan(tx90l, examples / "tx90l" / "frequency_poses.csv", "default", 0).poses[:2]
    frequency = design_frequency(tx90l, FrequencyRequest("quick", poses=poses, amplitude="flat"))
    assert len(frequency.plan.poses) == 2 and min(frequency.planned.std().values()) > 0
    for result in (trajectories, frequency):
        assert "of tx90l: " in repr(result)
        assert result.report(tmp_path / "page.html").is_file()
    with refused("E-RUN-038"):
        design_frequency(tx90l, FrequencyRequest("default"))
