"""The best joint offsets: exact where offsets are all that is wrong, better than the calibrated ones where they are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexcal.estimation import Parameter, Parameters
from flexcal.export import measure_export_error, render_offsets
from flexcal.export.offset_fit import fit_offsets
from flexcal.export.offset_table import offsets_of
from flexcal.export.representation_error import random_poses, tool_positions
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import Posterior, RobotModel
from flexcal.units import DEGREE


@pytest.fixture(scope="module")
def rigid(tx90l: RobotModel) -> RobotModel:
    """The TX90L without springs."""
    return tx90l.without_springs()


def test_offsets_alone_are_found(rigid: RobotModel) -> None:
    """And their standard deviations are those of the parameters, one for one."""
    names = [f"{name}.offset" for name in rigid.joint_names]
    values = 1e-3 * np.array([1.0, -2.0, 0.5, 1.5, -1.0, 3.0])
    mixing = np.random.default_rng(0).normal(size=(6, 6))
    covariance = 1e-8 * mixing @ mixing.T
    parameters = Parameters(Parameter(n, "rad", float(v)) for n, v in zip(names, values, strict=True))
    model = replace(
        rigid.with_values(dict(zip(names, values, strict=True))), posterior=Posterior(parameters, covariance)
    )
    fit = fit_offsets(model, rigid, "smr", keep_frames=True)
    np.testing.assert_allclose(fit.offsets, values, atol=1e-12)
    np.testing.assert_allclose(fit.std, np.sqrt(np.diag(covariance)), rtol=1e-4)
    free = fit_offsets(model, rigid, "smr", keep_frames=False)
    np.testing.assert_allclose(free.offsets[1:5], values[1:5], atol=1e-6)


def test_they_are_better_than_the_calibrated_offsets(tx90l: RobotModel, erroneous) -> None:
    """Held against the offsets of the calibration, and against any small change of their own."""
    model = erroneous(tx90l)
    rendered = render_offsets(model, tx90l, keep_frames=True)
    best = offsets_of(rendered.text, tx90l)[:6]
    q, _ = random_poses(model, None, np.random.default_rng(1))
    wanted = tool_positions(model, q)[0]

    def cost(offsets: np.ndarray) -> float:
        missed = wanted - point_kinematics(tx90l, q + offsets, jacobians=False).position
        return float(np.mean(np.sum(missed**2, axis=1)))

    assert cost(best) < 0.98 * cost(model.geometry.errors[:, 0])
    for step in 1e-4 * np.eye(6):
        assert cost(best) < min(cost(best + step), cost(best - step))


def test_base_and_tool_help(tx90l: RobotModel, erroneous) -> None:
    model = erroneous(tx90l)
    errors = []
    for keep in (True, False):
        rendered = render_offsets(model, tx90l, keep_frames=keep)
        loss = measure_export_error(model, rendered.tool, rendered.unrepresented)
        assert loss.error is not None
        assert loss.terms == ("axis misalignments and lengths", "elastic deflection")
        errors.append(loss.error.mean)
    assert errors[1] < 0.9 * errors[0]


def test_motor_values_follow_the_ratio(tx90l: RobotModel, erroneous) -> None:
    text = render_offsets(erroneous(tx90l), tx90l, keep_frames=True).text
    rows = [line.split(",") for line in text.splitlines() if ",offset," in line]
    for row, ratio in zip(rows, tx90l.drives.ratio, strict=True):
        value, degrees, motor = float(row[3]), float(row[5]), float(row[6])
        assert degrees == pytest.approx(value / DEGREE, abs=1e-6)
        assert motor == pytest.approx(ratio * value / DEGREE, abs=1e-5)
