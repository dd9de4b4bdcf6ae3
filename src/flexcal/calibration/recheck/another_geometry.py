"""Whether errors that no single change explains are those of another geometry rather than of more scatter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.calibration.recheck.global_test import GlobalTest
from flexcal.model.robot import GEOMETRY

CLEAR = 6.0
"""Twice the logarithm of a ratio of likelihoods from which one explanation is clearly the better: odds of 20."""
_LENGTH, _ANGLE = 3e-4, 5e-4
"""Relative sizes of errors of lengths, m, and of zeros and directions of axes, rad, as robots are made."""
_FACTORS = np.geomspace(1.0, 6.0, 40)
_SPREADS = np.geomspace(1e-3, 3.0, 60)


def for_another_geometry(test: GlobalTest, fitted: Sequence[tuple[float, int]]) -> float:
    """Twice the logarithm of the likelihood of a geometry that differs everywhere, over that of more scatter, with a single change or none.

    Each has one number, which is the likeliest: the size of random differences of all lengths, zeros and directions of axes (Rao 1965,
    random effects), or the factor of the scatter; a change costs by Schwarz's criterion. Of changes that were `fitted`, also large ones,
    the sums of squares that they leave and their numbers of parameters count too. Positive: the errors at the poses go together as those
    of one other robot do.
    """
    errors, whitening = test.errors, test.whitening
    effects = _effects(test)
    own, common = (whitening @ part @ whitening.T for part in (errors.own, errors.common))
    values, geometry = whitening @ errors.errors, effects @ effects.T
    changes = [np.zeros((len(values), 0)), *(item.basis for item in test.seen)]
    noisier = min(_deviance(values, factor**2 * own + common, changes) for factor in _FACTORS)
    noisier = min(noisier, *(misfit + count * float(np.log(len(values))) for misfit, count in fitted))
    other = min(_deviance(values, own + common + spread**2 * geometry, changes[:1]) for spread in _SPREADS)
    return noisier - other


def single_deviation(test: GlobalTest) -> float:
    """Least sum of squares that one length, zero or direction of an axis leaves that differs from the calibrated, as of a bent link."""
    values, effects = test.whitening @ test.errors.errors, _effects(test)
    sizes = np.sum(effects**2, axis=0)
    gains = (effects.T @ values) ** 2 / np.where(sizes > 0, sizes, np.inf)
    return float(values @ values - gains.max(initial=0.0))


def _effects(test: GlobalTest) -> np.ndarray:
    """Whitened effects (m, p) of the errors of all lengths, zeros and directions of axes, of their usual sizes."""
    errors = test.errors
    names = [f"{joint.name}.{key}" for joint in errors.model.motor_joints for key in GEOMETRY]
    names += [f"tool.{key}" for key in GEOMETRY if key.startswith("length")]
    sizes = np.array([_LENGTH if name.rpartition(".")[2].startswith("length") else _ANGLE for name in names])
    jacobian = errors.at.jacobian(names)
    return test.whitening @ (jacobian.reshape(-1, jacobian.shape[2]) * sizes)


def _deviance(values: np.ndarray, covariance: np.ndarray, changes: Sequence[np.ndarray]) -> float:
    """Least of twice the negative log-likelihoods of normal values (m,), but for a constant, about the best of the `changes` (m, k)."""
    root = np.linalg.cholesky(covariance)
    white = np.linalg.solve(root, np.column_stack([values, *changes]))
    size, first = 2 * float(np.log(np.diag(root)).sum()), 1
    found = []
    for change in changes:
        count = change.shape[1]
        columns = np.linalg.qr(white[:, first : first + count])[0]
        first += count
        left = white[:, 0] - columns @ (columns.T @ white[:, 0])
        found.append(size + float(left @ left) + count * float(np.log(len(values))))
    return min(found)
