"""Score tests for drives that harden or slip: poses and reference motion load the drives differently."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flexcal.elasticity.identification.fit import ResponseData, ResponseFit
from flexcal.elasticity.identification.score_test import score_test_rejects
from flexcal.elasticity.response_model import (
    ResponseModel,
    ResponseResidual,
    hardening_name,
    slip_share_name,
)
from flexcal.model.robot import RobotModel

ABSENT = 1e-6
"""Share of a slipping spring at which the effect of all is as good as none; their parameter is a logarithm."""


def with_hardening(model: RobotModel, data: ResponseData, fit: ResponseFit) -> ResponseData:
    """Data with the hardening of all drives as parameters if the residual of `fit`, without them, requires it; else unchanged."""
    return _supported(model, data, replace(data, hardening=True), hardening_name, fit)


def with_hysteresis(model: RobotModel, data: ResponseData, fit: ResponseFit) -> ResponseData:
    """The same with the hysteresis of all drives."""
    return _supported(model, data, replace(data, hysteresis=True), slip_share_name, fit)


def _supported(
    model: RobotModel, data: ResponseData, wider: ResponseData, name: Callable[[str], str], fit: ResponseFit
) -> ResponseData:
    """`wider` data, whose further parameters have a `name` for every driven joint, if the residual of `fit` requires them.

    Without a plan the torque of the drives is not known, and nothing is asked.
    """
    if data.plan is None:
        return data
    parameters = wider.parameters(model)[0]
    absent = {own: ABSENT for e in model.elastic if (own := slip_share_name(e.name)) in parameters}
    x = parameters.coordinates({**absent, **fit.estimate.values})
    predicting = ResponseModel.of(model, data.responses, parameters).with_loaded_drives(x, data.plan)
    residual = ResponseResidual.of(predicting, data.responses, data.weighting)
    residual = residual.shifted(predicting, [effect.shift for effect in fit.effects])
    numbers = [parameters.index(name(joint.name)) for joint in model.driven]
    columns = residual.linearise(x)[1][:, numbers] / parameters.natural_slope(x)[numbers]
    return wider if score_test_rejects(fit, data, fit.whiten(columns)) else data
