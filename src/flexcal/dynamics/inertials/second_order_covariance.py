"""Second-order covariance due to products of mass and centre of mass (second-order filter, Bar-Shalom 2001, §10.3).

Motor torques leave a link's mass as open as CAD, while its product with the centre of mass is known a hundred times better. Along that open
direction the truth lies on a curve, and the estimate's Gaussian on the tangent. The distance between the two is known in size and goes
into the covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from flexcal.dynamics.inertials.linearised_equations import SAMPLES_PER_LINE, LinearisedEquations
from flexcal.dynamics.signals import PeriodicMotion
from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.model.robot import RobotModel, uncertain_inertials
from flexcal.model.torques import inertial_parameters, torque_regressor

_STEP = 1e-3
_NOTHING = 1e-12
"""Variance, relative to the largest, below which a direction of the second-order terms is left out."""


@dataclass(frozen=True, eq=False)
class SecondOrderCovariance:
    """Second-order terms of the rows: `mean` (T, 2 K + 1, n) and `columns` (T, 2 K + 1, n, c), N m, with independent unit factors."""

    mean: np.ndarray
    columns: np.ndarray

    @classmethod
    def of(
        cls, model: RobotModel, estimate: Estimate, motions: Sequence[PeriodicMotion]
    ) -> SecondOrderCovariance:
        """Moments of the products δ_a δ_b of the deviations δ of an estimate, by Isserlis' theorem, times their effect on the torques."""
        names = uncertain_inertials(model, range(model.n))
        bends, pairs = _second_derivatives(model, estimate.parameters.subset(names))
        a, b = pairs.T
        c = estimate.marginal(names)[1]
        moments = c[np.ix_(a, a)] * c[np.ix_(b, b)] + c[np.ix_(a, b)] * c[np.ix_(b, a)]
        sizes, turns = np.linalg.eigh(moments)
        kept = sizes > _NOTHING * sizes.max(initial=0.0)
        rows = np.array(
            [
                motion.rows(torque_regressor(model, *motion.states(SAMPLES_PER_LINE * motion.lines))) @ bends
                for motion in motions
            ]
        )
        return cls(rows @ c[a, b], rows @ (turns[:, kept] * np.sqrt(sizes[kept])))

    def added_to(self, rows: LinearisedEquations) -> LinearisedEquations:
        """Rows with these terms beside the linear ones, as further unknowns."""
        count = self.columns.shape[-1]
        unknown = Parameters(Parameter(f"curvature_{k + 1}", "1", 0.0, prior_std=1.0) for k in range(count))
        return LinearisedEquations(
            rows.parameters + unknown,
            rows.measured,
            rows.residual - self.mean,
            np.concatenate([rows.jacobian, self.columns], axis=-1),
        )


def _second_derivatives(model: RobotModel, parameters: Parameters) -> tuple[np.ndarray, np.ndarray]:
    """Effect (10 n, c) of δ_a δ_b on the links' inertial parameters, and the numbers a ≤ b (c, 2): both of one link."""
    x = parameters.coordinates()
    owner = [name.rpartition(".")[0] for name in parameters.names]
    pairs = [p for p in combinations_with_replacement(range(len(x)), 2) if owner[p[0]] == owner[p[1]]]

    def at(*steps: tuple[int, float]) -> np.ndarray:
        moved = x.copy()
        for number, step in steps:
            moved[number] += step
        natural = parameters.natural(moved)
        return inertial_parameters(model.with_values(dict(zip(parameters.names, natural, strict=True))))

    bends = np.empty((len(at()), len(pairs)))
    for k, (i, j) in enumerate(pairs):
        mixed = sum(s * t * at((i, s * _STEP), (j, t * _STEP)) for s in (-1, 1) for t in (-1, 1))
        bends[:, k] = mixed / (4 * _STEP**2) * (0.5 if i == j else 1.0)
    return bends, np.array(pairs, dtype=int).reshape(-1, 2)
