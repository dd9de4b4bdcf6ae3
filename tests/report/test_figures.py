"""What the figures show is what the results say."""

from __future__ import annotations

import re
from dataclasses import replace
from importlib.resources import files
from typing import Any, cast

import numpy as np
import pytest

from flexcal.calibration.verification.arm_poses import joint_polylines
from flexcal.model.kinematics import joint_origins
from flexcal.model.robot import RobotModel
from flexcal.report.figures import (
    ErrorSeries,
    error_components,
    predicted_quantiles,
    response_fit,
    response_levels,
    sensor_fit,
    singular_values,
    spring_intervals,
    verification_errors,
)
from flexcal.report.figures.error_distributions import expected_quantiles
from flexcal.report.layout import INK, PAGE, canvas, log_ticks
from flexcal.report.results import TwoStageStudy
from flexcal.report.sections.geometry import exaggeration


def test_skeletons_go_through_the_joints(tx90l: RobotModel, study: TwoStageStudy) -> None:
    poses = study.points.poses
    lengths = {f"{joint}.length_{k}": 0.01 for joint in tx90l.joint_names for k in "xyz"}
    robot = tx90l.with_values({name: 0.0 for name in lengths})
    corners = joint_polylines(robot, poses)
    np.testing.assert_allclose(corners, joint_origins(robot, poses.q), atol=1e-12)


def test_expected_quantiles_are_those_of_a_simulation(rng: np.random.Generator) -> None:
    std = rng.uniform(0.5, 2.0, 400)
    draws = np.linalg.norm(std[:, None, None] / np.sqrt(3.0) * rng.normal(size=(400, 500, 3)), axis=2)
    middle = (np.arange(400) + 0.5) / 400
    np.testing.assert_allclose(expected_quantiles(std), np.quantile(draws, middle), rtol=0.03, atol=0.03)


def test_quantiles_leave_out_uncertain_flanks(study: TwoStageStudy) -> None:
    figure = predicted_quantiles(study.verification)
    assert len(figure.plotly().data[1].y) == (~study.verification.ambiguous).sum() < 150


def test_levels_show_response_noise_and_distortion(study: TwoStageStudy) -> None:
    response = study.responses[0]
    figure = response_levels([response], ["pose 1"])
    assert len(figure.plotly().data) == 27
    np.testing.assert_allclose(figure.plotly().data[0].y, np.abs(response.response[:, 0, 0]), rtol=1e-6)
    np.testing.assert_allclose(figure.plotly().data[3 * 5 + 2].y, response.noise_std[:, 1, 2], rtol=1e-6)


def test_hover_labels_hide_what_is_behind_them() -> None:
    """Ink on the page's colour, which the dark scheme knows too; a translucent label is read through the curves behind it."""
    label = cast(Any, canvas(300).plotly().layout).hoverlabel
    assert (label.bgcolor, label.font.color) == (PAGE, INK)
    style = files("flexcal.report").joinpath("templates", "report.css").read_text("utf-8")
    opacity = [rule for rule in style.splitlines() if "hovertext" in rule]
    assert opacity and not any(
        re.search(r"opacity:\s*0?\.", rule) or "hovertext path" in rule for rule in opacity
    )


def test_fit_shows_one_pose_at_first(study: TwoStageStudy) -> None:
    labels = ("A", "B", "C")
    figure = response_fit(study.responses, labels)
    assert {t.meta["pose"] for t in figure.plotly().data if t.visible} == {"A"}
    assert len(figure.plotly().data) == 3 * 2 * (9 + 3)


def test_spring_intervals_are_relative(tx90l: RobotModel, study: TwoStageStudy) -> None:
    estimate = study.stiffness
    stiffness, damping = study.springs("stiffness"), study.springs("damping")
    assert len(stiffness) == len(damping) == 9
    figure = spring_intervals(estimate, stiffness, damping, tx90l.values, "robot.yaml")
    name = stiffness[0]
    drawn = figure.plotly().data[0]
    assert drawn.x[0] == pytest.approx(100 * (estimate.values[name] / tx90l.value(name) - 1), rel=1e-5)
    low, high = estimate.interval(name) or (0.0, 0.0)
    width = 100 * (high - low) / tx90l.value(name)
    assert drawn.error_x.array[0] + drawn.error_x.arrayminus[0] == pytest.approx(width, rel=1e-4)
    assert "not determined by these data" in {text for t in figure.plotly().data if t.text for text in t.text}


def test_components_share_one_scale(study: TwoStageStudy) -> None:
    figure = error_components(study.points.poses, study.points.calibrated)
    ranges = {tuple(axis.range) for axis in figure.plotly().select_yaxes()}
    assert len(ranges) == 1
    assert max(ranges)[1] >= 1e3 * np.abs(study.points.calibrated).max()


def test_the_instruments_noise_stays_within_the_axes(study: TwoStageStudy) -> None:
    sigma = study.points.poses.sigma.copy()
    sigma[3, 1] = 5e-4
    figure = error_components(replace(study.points.poses, sigma=sigma), study.points.calibrated)
    assert max(axis.range[1] for axis in figure.plotly().select_yaxes()) >= 1.0


def test_published_errors_are_named_in_the_legend(study: TwoStageStudy) -> None:
    assert study.paper is not None and study.paper.elastic is not None
    series = [ErrorSeries("elastic", "blue", study.verification.errors)]
    figure = verification_errors(study.fresh.poses, series, study.verification, study.paper.elastic)
    heights = {trace.name: trace.y[0] for trace in figure.plotly().data if trace.mode == "lines"}
    assert heights == pytest.approx({"paper, 90 %": 0.23, "paper, worst": 0.32}, rel=1e-6)
    assert not figure.plotly().layout.annotations


def test_rank_is_marked_where_it_is(study: TwoStageStudy) -> None:
    found = study.determined
    figure = singular_values(found.singular_values, found.diagonal, found.rank, found.gap)
    assert "rank 29" in figure.plotly().layout.annotations[0].text
    assert figure.plotly().layout.shapes[0].x0 == 29.5


def test_ticks_keep_their_size() -> None:
    assert log_ticks(-1, 1)["ticktext"] == ["10⁻¹", "1", "10"]


def test_arrows_are_round_and_short() -> None:
    assert exaggeration(np.array([[1e-4, 0.0, 0.0]]), 0.25) == 2000
    assert exaggeration(np.array([[0.0, 5e-3, 0.0]]), 0.25) == 50


def test_readings_of_sensors_are_drawn_by_sensor_and_motor(study: TwoStageStudy) -> None:
    lines, n = study.responses[0].response.shape[:2]
    read = np.arange(1.0, 1 + lines * 2 * n).reshape(lines, 2, n) + 0j
    response = replace(
        study.responses[0], sensors=("hand", "beam"), sensor_units=("m/s²", "m/s"), sensor_response=read, sensor_predicted=2 * read
    )  # fmt: skip
    figure = sensor_fit([response], ["Pose 1"])
    drawn = {(trace.name, trace.yaxis): trace for trace in figure.plotly().data}
    assert len(drawn) == 2 * 2 * n
    np.testing.assert_allclose(drawn["fitted model", f"y{n + 2}"].y, 2 * read[:, 1, 1].real)
    assert figure.plotly().layout[f"yaxis{n + 1}"].title.text == "m/s per N m"
