"""What a format loses is what the tool is off by, over the poses where the robot works."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexcal.export import export_urdf, measure_export_error
from flexcal.export.mjcf_file import mjcf_tool, render_mjcf
from flexcal.export.representation_error import AT_REST, random_poses
from flexcal.export.sdf import render_sdf, sdf_tool
from flexcal.export.urdf import render_urdf, urdf_tool
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.model.robot.config import BoxConfig
from flexcal.model.statics import gravity_moments


def test_backlash_of_one_joint_is_its_lever_times_the_gap(tx90l: RobotModel) -> None:
    """Half the gap of the second joint, times the tool's distance from its axis."""
    gap = 1e-4
    rigid = tx90l.without_springs()
    model = rigid.with_values({"joint_2.backlash": gap})
    loss = measure_export_error(
        model, lambda q: point_kinematics(model, q, jacobians=False).position, AT_REST
    )
    q, within = random_poses(model, None, np.random.default_rng(0))
    tool = point_kinematics(model, q)
    lever = np.linalg.norm(tool.geometry_jacobian[:, :3, 6], axis=1)
    assert loss.error is not None and within == "joint range" and len(loss.terms) == 1
    assert loss.error.mean == pytest.approx(gap * lever.mean(), rel=1e-3)
    assert loss.error.p95 == pytest.approx(gap * np.percentile(lever, 95), rel=1e-3)
    assert loss.error.max == pytest.approx(gap * lever.max(), rel=1e-3)
    assert loss.terms == ("backlash",)


def test_the_declared_working_volume_is_where_it_is_measured(tx90l: RobotModel) -> None:
    box = BoxConfig((0.4, -0.3, 0.3), (0.8, 0.3, 0.8))
    model = replace(tx90l, config=replace(tx90l.config, working_volume=box))
    q, within = random_poses(model, None, np.random.default_rng(0))
    reached = point_kinematics(model, q, jacobians=False).position
    assert within == "working volume" and len(q) > 500
    assert (reached > np.array(box.lower) - 2e-4).all() and (reached < np.array(box.upper) + 2e-4).all()


def test_a_robot_without_points_names_what_is_lost_without_millimetres(
    tx90l: RobotModel, tmp_path: Path
) -> None:
    export = export_urdf(replace(tx90l, points={}), tmp_path / "robot.urdf")
    assert export.loss.error is None and export.lost == ("elastic deflection",)
    assert "declares no point" in str(export)


def test_a_transmission_error_is_its_lever_times_the_wave(tx90l: RobotModel) -> None:
    wave = 1e-4
    rigid = tx90l.without_springs()
    model = rigid.with_values({"joint_3.transmission_2_sin": wave, "joint_1.length_x": 1e-3})
    loss = measure_export_error(
        model, lambda q: point_kinematics(model, q, jacobians=False).position, AT_REST
    )
    q, _ = random_poses(model, None, np.random.default_rng(0))
    lever = np.linalg.norm(point_kinematics(model, q).geometry_jacobian[:, :3, 12], axis=1)
    expected = wave * np.abs(np.sin(2 * q[:, 2])) * lever
    assert loss.error is not None and loss.terms == ("transmission error",)
    assert loss.error.mean == pytest.approx(expected.mean(), rel=1e-3)


def test_lateral_compliance_is_named_with_what_it_costs(tx90l: RobotModel) -> None:
    rigid = tx90l.without_springs()
    model = rigid.with_values({"joint_1.gravity_compliance_1": 1e-6, "joint_1.gravity_compliance_2": 1e-6})
    loss = measure_export_error(
        model, lambda q: point_kinematics(model, q, jacobians=False).position, AT_REST
    )
    q, _ = random_poses(model, None, np.random.default_rng(0))
    jacobian = point_kinematics(model, q).geometry_jacobian[:, :3, 1:3]
    moved = np.matmul(jacobian, 1e-6 * gravity_moments(model, q)[:, 0, :, None])[:, :, 0]
    assert loss.error is not None and loss.terms == ("lateral gravity compliance",)
    assert loss.error.mean == pytest.approx(np.linalg.norm(moved, axis=1).mean(), rel=1e-3)


@pytest.mark.parametrize("form", ["urdf", "mjcf", "sdf"])
def test_the_file_is_what_is_measured(tx90l: RobotModel, form: str) -> None:
    """A millimetre that goes wrong in the text is found in the error."""
    rigid = tx90l.without_springs()
    render, read = {
        "urdf": (render_urdf, urdf_tool),
        "mjcf": (render_mjcf, mjcf_tool),
        "sdf": (lambda model: render_sdf(model, tx90l), sdf_tool),
    }[form]
    text = render(rigid).text
    assert "0.478" in text
    loss = measure_export_error(rigid, read(rigid, text.replace("0.478", "0.479", 1)), ())
    assert loss.error is not None and loss.terms == ()
    assert loss.error.mean == pytest.approx(1e-3) and loss.error.max == pytest.approx(1e-3)
