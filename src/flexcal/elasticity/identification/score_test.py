"""Rao's score test: whether the residual of a fit supports further parameters."""

from __future__ import annotations

import numpy as np

from flexcal.elasticity.identification.fit import ResponseData, ResponseFit


def score_test_rejects(fit: ResponseFit, data: ResponseData, columns: np.ndarray) -> bool:
    """Whether `fit` is rejected in favour of parameters that change its whitened residual by `columns` (m, k).

    With C the columns orthogonal to those of all fitted parameters, T = rᵀ C (Cᵀ C)⁻¹ Cᵀ r is χ² of k degrees of freedom, times the
    variance of what is left. The threshold is the Bayesian information criterion's, log(rows) a parameter.
    """
    residual, jacobian = fit.problem.linearise(fit.x)
    prior_rows = fit.problem.prior_rows()
    offset = prior_rows @ (fit.x - fit.problem.parameters.prior_mean())
    count = columns.shape[1]
    columns = np.vstack([columns, np.zeros((len(prior_rows), count))])
    nuisance = np.vstack([jacobian, prior_rows])
    basis = np.linalg.qr(nuisance / np.linalg.norm(nuisance, axis=0))[0]
    columns = columns - basis @ (basis.T @ columns)
    scores = columns.T @ np.concatenate([residual, offset])
    statistic = scores @ np.linalg.lstsq(columns.T @ columns, scores)[0]
    variance = max(1.0, fit.estimate.reduced_chi2) * data.tolerances.inflation(data.responses)
    return bool(statistic > variance * count * np.log(len(residual)))
