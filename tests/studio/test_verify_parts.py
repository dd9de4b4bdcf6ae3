"""Parts of the page that verifies, maps, compensates and exports, without a browser."""

from __future__ import annotations

import shutil
from pathlib import Path

import calibrated_ur5
import numpy as np
import polars as pl
import pytest

from flexcal.calibration.accuracy import PredictedAccuracy, distance_to_nominal
from flexcal.errors import FlexcalError, InputError
from flexcal.jobs.accuracy import MapTable
from flexcal.jobs.deployment import export_robot
from flexcal.jobs.inputs import CalibratedRobot
from flexcal.jobs.result_files import read_arm
from flexcal.model.kinematics import point_kinematics
from flexcal.studio.project import Project
from flexcal.studio.scene import ColourScale
from flexcal.studio.steps.results import ResultSource
from flexcal.studio.steps.verify.corrected_command import CorrectedCommand, TypedTarget
from flexcal.studio.steps.verify.export_formats import complete_formats, export_formats
from flexcal.studio.steps.verify.fresh_files import fresh_files
from flexcal.studio.steps.verify.legend import legend
from flexcal.studio.steps.verify.target_files import target_files
from flexcal.studio.steps.verify.working_places import working_places
from flexcal.studio.window import Selection


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return calibrated_ur5.make(tmp_path_factory.mktemp("parts") / "ur5")


@pytest.fixture(scope="module")
def robot(folder: Path) -> CalibratedRobot:
    return CalibratedRobot.from_yaml(folder / "robot.yaml", folder / "calibration")


def test_fresh_poses_are_those_that_the_calibration_did_not_read(folder: Path) -> None:
    assert fresh_files(Project.open(folder)) == ["random.csv"]


def test_a_table_with_rows_of_the_calibration_is_not_fresh(folder: Path, tmp_path: Path) -> None:
    """Whatever it is called and whichever columns it has; the same joint positions measured anew are fresh."""
    shutil.copytree(folder, tmp_path / "ur5")
    grid = pl.read_csv(tmp_path / "ur5" / "grid.csv", infer_schema_length=None)
    grid.tail(3).with_columns(note=pl.lit("again")).write_csv(tmp_path / "ur5" / "tracker.csv")
    grid.with_columns(pl.col("x") + 0.001).write_csv(tmp_path / "ur5" / "anew.csv")
    names = fresh_files(Project.open(tmp_path / "ur5"))
    assert "tracker.csv" not in names
    assert sorted(names) == ["anew.csv", "random.csv"]


def test_a_result_names_the_table_that_it_is_of(folder: Path, tmp_path: Path) -> None:
    """Not another one that is chosen; a table of the same name with other rows has changed."""
    source = ResultSource.read(folder / "calibration")
    assert source is not None and source.title.startswith("calibration of grid.csv, ")
    assert source.difference(folder, "grid.csv") == ""
    told = source.difference(folder, "random.csv")
    assert told == "The result below is of grid.csv; random.csv has not been used."
    (tmp_path / "grid.csv").write_text("pose\n1\n")
    assert "has changed since" in source.difference(tmp_path, "grid.csv")
    assert ResultSource.read(tmp_path) is None


def test_the_box_of_a_map_encloses_the_measured_points(folder: Path) -> None:
    places = working_places(Project.open(folder))
    (option,) = places["a box around the measured points"]
    ranges = [[float(end) for end in part.split(":")] for part in option.split("=")[1].split(",")]
    tip = read_arm(folder / "calibration").tip
    lower, upper = np.array(ranges).T
    assert (lower <= tip.min(axis=0) - 0.05).all() and (upper >= tip.max(axis=0) + 0.05).all()
    assert (tip.min(axis=0) - lower < 0.0601).all() and (upper - tip.max(axis=0) < 0.0601).all()
    assert "the working volume of robot.yaml" not in places


def test_maps_and_commands_are_neither_targets_nor_poses(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_text("x,y,z,q1,mean_mm,p95_mm\n0,0,0,0,1,2\n")
    (tmp_path / "commands.csv").write_text("pose,q1,target,unambiguous\n1,0,smr,true\n")
    (tmp_path / "my_targets.csv").write_text("pose,x,y,z\n1,0.4,0.2,0.3\n")
    (tmp_path / "poses.csv").write_text("pose,q1,x,y,z\n1,0,0.4,0.2,0.3\n")
    project = Project.open(tmp_path)
    assert target_files(project) == ["my_targets.csv", "poses.csv"]
    assert fresh_files(project) == ["poses.csv"]


def test_formats_that_do_not_apply_say_why(folder: Path) -> None:
    formats = {each.name: each for each in export_formats(Project.open(folder))}
    assert "no actuators" in formats["isaac"].refusal
    assert {name for name, each in formats.items() if not each.refusal} >= {
        "urdf",
        "mjcf",
        "dh",
        "offsets",
        "json",
        "xacro",
    }


def test_a_map_is_read_as_it_was_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    map = MapTable(
        PredictedAccuracy(rng.random((5, 6)), rng.random((5, 3)), rng.random(5), rng.random(5)), rng.random(5)
    )
    map.write(tmp_path / "map.csv")
    back = MapTable.read(tmp_path / "map.csv")
    for name in ("q", "position", "mean", "p95"):
        np.testing.assert_allclose(getattr(back.predicted, name), getattr(map.predicted, name), rtol=1e-15)
    assert back.uncalibrated is not None and map.uncalibrated is not None
    np.testing.assert_allclose(back.uncalibrated, map.uncalibrated, rtol=1e-15)
    pl.read_csv(tmp_path / "map.csv").drop("p95_mm").write_csv(tmp_path / "other.csv")
    with pytest.raises(InputError, match="no column 'p95_mm'"):
        MapTable.read(tmp_path / "other.csv")


def test_the_uncalibrated_error_is_what_no_motion_of_the_robot_explains(robot: CalibratedRobot) -> None:
    """Zero for a robot that is only placed elsewhere; against SciPy's alignment for the calibrated one."""
    from scipy.spatial.transform import Rotation

    nominal, q = robot.with_points, np.random.default_rng(2).uniform(-1.5, 1.5, (60, 6))
    same = distance_to_nominal(nominal, nominal, q, "smr", 0.0)
    assert same is not None and same.max() < 1e-12
    moved = nominal.with_values({"shoulder_pan_joint.offset": 0.01})
    turned = distance_to_nominal(moved, nominal, q, "smr", 0.0)
    assert turned is not None and turned.max() < 1e-9
    off = distance_to_nominal(robot.model, nominal, q, "smr", 0.0)
    real, expected = (
        point_kinematics(m, q, point="smr", jacobians=False).position for m in (robot.model, nominal)
    )
    centred = real - real.mean(axis=0), expected - expected.mean(axis=0)
    rotation, _ = Rotation.align_vectors(*centred)
    np.testing.assert_allclose(
        off, np.linalg.norm(centred[0] - rotation.apply(centred[1]), axis=1), atol=1e-7
    )
    assert distance_to_nominal(robot.model, nominal, q[:3], "smr", 0.0) is None


def test_the_corrected_command_brings_the_tool_there(robot: CalibratedRobot) -> None:
    """Where the nominal robot would be at joint positions, the corrected one is; its nominal command is these."""
    q = np.array([0.3, -1.2, 1.5, 0.1, 1.6, 0.2])
    target = TypedTarget.of_tool(robot.with_points, q, "smr")
    found = CorrectedCommand.of(robot, target, q)
    np.testing.assert_allclose(found.nominal, q, atol=1e-7)
    at = point_kinematics(robot.probable, found.q[None], point="smr", jacobians=False).position[0]
    np.testing.assert_allclose(at, target.position, atol=1e-7)
    nominal = point_kinematics(robot.probable, q[None], point="smr", jacobians=False).position[0]
    assert found.before == pytest.approx(np.linalg.norm(nominal - target.position), abs=1e-7)
    assert found.mean is not None and found.p95 is not None and 0 < found.mean < found.p95 < 0.005


def test_a_target_out_of_reach_is_refused(robot: CalibratedRobot) -> None:
    with pytest.raises(FlexcalError, match="out of reach"):
        CorrectedCommand.of(robot, TypedTarget("smr", np.array([1.4, 0.2, 0.3])))


def test_the_legend_tells_its_ends(robot: CalibratedRobot) -> None:
    text = legend(ColourScale(2.0), "error <of> tool", "mm")
    assert "<span>0</span><span>0.5</span><span>1</span><span>1.5</span><span>≥ 2</span>" in text
    assert "&lt;of&gt;" in text and "<of>" not in text


def test_a_scale_that_is_fitted_shows_small_differences() -> None:
    """The ends of the values have the first and the last colour, in place of all the last one."""
    values = np.linspace(0.11, 0.13, 201)
    fitted = ColourScale.fitted(values)
    assert fitted.share(np.array([0.0, 0.11, 0.12, 0.13])) == pytest.approx([0, 0, 0.5, 1], abs=0.01)
    assert "<span>≤ 0.11</span>" in legend(fitted, "error", "mm")
    assert np.isfinite(ColourScale.fitted(np.full(3, 0.2)).colours(values)).all()


def test_formats_that_carry_the_calibrated_robot_lose_nothing(folder: Path, tmp_path: Path) -> None:
    """Each that is recommended, by the error of its file."""
    robot = CalibratedRobot.from_yaml(folder / "robot.yaml", folder / "calibration")
    names = complete_formats(Project.open(folder))
    assert {"json", "runtime"} <= set(names)
    for name in names:
        error = export_robot(robot, tmp_path / name, name).document()["tool_error"]
        assert error["max_mm"] < 1e-6


def test_a_pose_of_another_table_is_deselected() -> None:
    selection = Selection()
    selection.of("poses")
    selection.pick("12")
    selection.of("poses")
    assert selection.key == "12"
    selection.of("others")
    assert selection.key is None
