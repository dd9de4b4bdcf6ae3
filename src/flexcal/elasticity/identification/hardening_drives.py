"""Score test for hardening drives: poses and reference motion load the drives differently."""

from __future__ import annotations

from dataclasses import replace

from flexcal.elasticity.identification.fit import ResponseData, ResponseFit
from flexcal.elasticity.identification.score_test import score_test_rejects
from flexcal.elasticity.response_model import ResponseModel, ResponseResidual, hardening_name
from flexcal.model.robot import RobotModel


def with_hardening(model: RobotModel, data: ResponseData, fit: ResponseFit) -> ResponseData:
    """Data with the hardening of all drives as parameters if the residual of `fit`, without them, requires it; else unchanged.

    Without a plan the torque of the drives is not known, and nothing is asked.
    """
    if data.plan is None or data.hardening:
        return data
    wider = replace(data, hardening=True)
    parameters = wider.parameters(model)[0]
    x = parameters.coordinates(fit.estimate.values)
    predicting = ResponseModel.of(model, data.responses, parameters).with_loaded_drives(x, data.plan)
    residual = ResponseResidual.of(predicting, data.responses, data.weighting)
    residual = residual.shifted(predicting, [effect.shift for effect in fit.effects])
    numbers = [parameters.index(hardening_name(joint.name)) for joint in model.driven]
    columns = residual.linearise(x)[1][:, numbers] * parameters.prior_std()[numbers]
    return wider if score_test_rejects(fit, data, fit.whiten(columns)) else data
