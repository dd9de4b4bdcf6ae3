"""Uncertainty of an estimate due to the inertials kept nominal in the equations of tilting bearings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.dynamics.estimators import noise_levels, weighted_system
from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.regression import RegressionData
from flexcal.estimation import Estimate
from flexcal.model.robot import declared_parameter, uncertain_inertials, uncertain_tensor_entries

_STEP = 1e-4
"""Step of the central differences, in estimation coordinates."""


def with_nominal_uncertainty(data: RegressionData, estimate: Estimate) -> Estimate:
    """Estimate with its covariance increased by the uncertainty of nominal parameters that it does not contain.

    In a rigid arm the others absorb these exactly, by the regrouping. In the equation of a bearing a link also adds torque in proportion to
    the tilt and to its acceleration, too little to be told from the spring's, so that errors of CAD bias the stiffness. With δ the
    deviations that robot.yaml's `prior:` admits (masses, centres of mass, and inertia tensors), the estimate
    deviates by (W_k⁺ W_d - β) δ_d, with β the regrouping (parameters considered but not estimated: Schmidt 1966). Without tilts nothing
    changes. Raises `FlexcalError` as `noise_levels` does.
    """
    observation = data.observation
    if not isinstance(observation, Observation) or not observation.bearings:
        return estimate
    names = estimate.parameters.names
    kept = np.flatnonzero(estimate.identifiable)
    nominal = np.flatnonzero(~np.array(estimate.identifiable))
    matrix = weighted_system(data, noise_levels(data)).matrix
    scale = np.linalg.norm(matrix[:, kept], axis=0)
    absorbed = np.linalg.lstsq(matrix[:, kept] / scale, matrix[:, nominal], rcond=None)[0] / scale[:, None]
    number = {name: row for row, name in enumerate(names[i] for i in kept)}
    column = {name: k for k, name in enumerate(names[i] for i in nominal)}
    for entry in estimate.dropped:
        for heir, share in entry.absorbed_by:
            if heir in number and entry.name in column:
                absorbed[number[heir], column[entry.name]] -= share
    root = absorbed @ _deviations(observation)[nominal]
    covariance = estimate.covariance.copy()
    covariance[np.ix_(kept, kept)] += root @ root.T
    return replace(estimate, covariance=covariance)


def _deviations(observation: Observation) -> np.ndarray:
    """Columns (p, d) of one CAD standard deviation each of the links, in all parameters of the observation."""
    model, columns = observation.model, []
    for name in uncertain_inertials(model, range(model.n)):
        item = declared_parameter(model, name)
        at = item.coordinate(model.value(name))
        ends = [
            replace(observation, model=model.with_values({name: item.natural(at + step)})).values()
            for step in (_STEP, -_STEP)
        ]
        columns.append(item.prior_std * (ends[0] - ends[1]) / (2 * _STEP))
    names = list(observation.names)
    for number, entry, std in uncertain_tensor_entries(model):
        column = np.zeros(len(names))
        column[names.index(f"{model.joints[number].link}.{entry}")] = std
        columns.append(column)
    return np.array(columns).T
