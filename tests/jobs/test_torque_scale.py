"""Torques in another unit, told by inertia that all comes out at one factor, of an arm whose responses are in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from elastic_scara import scara, write_scara

from flexcal import RobotModel, identify_stiffness
from flexcal.elasticity.identification import MultiStart
from flexcal.jobs.stiffness import StiffnessIdentification


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    return RobotModel.from_yaml(write_scara(tmp_path_factory.mktemp("scara")))


def _identified(model: RobotModel, factor: float) -> tuple[np.ndarray, StiffnessIdentification]:
    """True stiffnesses, and what responses to torques tell that the log has `factor` times too large."""
    robot = scara(np.random.default_rng(3), spread=0.015)
    measured = [
        replace(
            response,
            response=response.response / factor,
            covariance=response.covariance / factor**2,
            noise_covariance=response.noise_covariance / factor**2,
            realisations=response.realisations / factor,
        )
        for response in robot.measured(np.random.default_rng(4), 0.05)
    ]
    return np.array(robot.stiffness), identify_stiffness(
        model, measured, search=MultiStart(starts=1, agreement=1)
    )


def test_torques_in_newton_metres_are_not_doubted(model: RobotModel) -> None:
    assert _identified(model, 1.0)[1].fit.scale is None


@pytest.mark.parametrize(("factor", "status"), [(1 / 18, "bad"), (1.3, "care")])
def test_torques_in_another_unit_are_told(model: RobotModel, factor: float, status: str) -> None:
    """The factor is told, and no interval of a stiffness is narrower than it."""
    truth, found = _identified(model, factor)
    scale = found.fit.scale
    assert scale is not None
    assert abs(np.log(scale.factor / factor)) < 0.15 * abs(np.log(factor)) + 0.03
    assert "torque_scale" in {check.code for check in found.trust.checks if check.status == status}
    assert any("or the torques are" in remark for remark in found.remarks)
    for name, value in zip(found.springs, truth, strict=False):
        interval = found.estimate.interval(name)
        assert interval is None or interval[0] < value < interval[1]
        assert found.estimate.std(name) is None or status == "care"
