"""Least squares with conic constraints, and the most probable of nearly optimal solutions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation.conic_constraint import Cone

_TOLERANCE, _RELATIVE_TOLERANCE = 0.05, 1e-3
"""Largest shift of base parameters from the data's optimum by the prior: in standard deviations, and relative to the shift by
feasibility.
"""
_RESOLUTION, _FINEST = 1e-9, 1e-4
"""Resolution of the solver relative to the size of the problem, and the smallest unit it supports: noise-free data ask for less."""
_SLACK = 1e-5
"""Violation of a cone's floor by the solver, relative to its reference, that is tolerated."""
_SOLVED = ("Solved", "AlmostSolved")


@dataclass(frozen=True, eq=False)
class ConicFit:
    """χ = `least` + `root` y + `unseen` z within `cones`: y (k,) raises the sum of squares from its minimum by ‖y‖², z (d,) does not.

    `size` is what ‖y‖ is expected to stay below; it scales the problem.
    """

    least: np.ndarray
    root: np.ndarray
    unseen: np.ndarray
    cones: Sequence[Cone]
    size: float

    def solve(self) -> tuple[np.ndarray, float]:
        """The parameters (p,), and by how much the sum of squares rises.

        First ‖y‖ is minimised, a second-order cone program with semidefinite constraints (Sousa & Cortesão 2014); then, no farther than
        0.05 from that y*, the distance to the references in standard deviations. So the prior moves no base parameter by more than 0.05
        of its standard deviation (to which come a thousandth of ‖y*‖ and, for data without noise, 1e-9 of `size`).
        Raises `FlexcalError` where the solver does not get there.
        """
        seen, plane = self.root.shape[1], np.column_stack([self.root, self.unseen])
        length = np.eye(seen, plane.shape[1]), np.zeros(seen)
        first = self._nearest(plane, length, self.size, self.size, np.inf)
        pushed = float(np.linalg.norm(first[:seen]))
        radius = _TOLERANCE + _RELATIVE_TOLERANCE * pushed + _RESOLUTION * self.size
        optimum = replace(self, least=self.least + self.root @ first[:seen])
        prior = optimum._prior(plane)
        far, unit = float(np.linalg.norm(prior[1])), max(radius, _FINEST * self.size)
        second = optimum._nearest(plane, prior, far, unit, radius)
        parameters = optimum.least + plane @ second
        if min(cone.smallest(parameters) - cone.floor for cone in self.cones) < -_SLACK:
            raise _failure("not accurate enough")
        return parameters, float(np.sum((first + second)[:seen] ** 2))

    def _prior(self, plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Matrix and right side, whose difference at (y, z) is the distance to the references in standard deviations."""
        matrices, rights = [], []
        for cone in self.cones:
            if np.isfinite(cone.std):
                rows, one = cone.rows()
                matrices.append(rows @ plane[cone.column_indices] / cone.std)
                rights.append((one - rows @ self.least[cone.column_indices]) / cone.std)
        return np.vstack(matrices), np.concatenate(rights)

    def _nearest(
        self, plane: np.ndarray, aim: tuple[np.ndarray, np.ndarray], size: float, unit: float, radius: float
    ) -> np.ndarray:
        """(y, z) that minimises ‖matrix (y, z) - right‖, the `aim`, within the cones and with ‖y‖ ≤ `radius`.

        The solver is told the aim in `size` and y in `unit`. Its unknowns are the norm and (y, z), its constraints b - A x in a cone.
        """
        import clarabel
        from scipy.sparse import csc_matrix

        seen, count = self.root.shape[1], plane.shape[1]
        units = np.r_[np.full(seen, unit), np.ones(count - seen)]
        matrix, right = aim
        kinds = [clarabel.SecondOrderConeT(len(right) + 1)]
        blocks = [_bordered(matrix * units / size, 1.0)]
        bounds = [np.r_[0.0, -right / size]]
        if np.isfinite(radius):
            kinds.append(clarabel.SecondOrderConeT(seen + 1))
            blocks.append(_bordered(np.eye(seen, count), 0.0))
            bounds.append(np.r_[radius / unit, np.zeros(seen)])
        for cone in self.cones:
            rows, one = cone.rows()
            kinds.append(clarabel.PSDTriangleConeT(cone.size))
            blocks.append(_bordered(rows @ (plane * units)[cone.column_indices], 0.0)[1:])
            bounds.append(rows @ self.least[cone.column_indices] - cone.floor * one)
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        quadratic, linear = csc_matrix((count + 1, count + 1)), np.eye(count + 1)[0]
        constraints = csc_matrix(-np.vstack(blocks))
        solver = clarabel.DefaultSolver(
            quadratic, linear, constraints, np.concatenate(bounds), kinds, settings
        )
        solution = solver.solve()
        if str(solution.status) not in _SOLVED:
            raise _failure(str(solution.status))
        return units * np.array(solution.x[1:])


def _bordered(matrix: np.ndarray, corner: float) -> np.ndarray:
    """A matrix with a row and a column of zeros before its first, and `corner` where they meet."""
    result = np.zeros((len(matrix) + 1, len(matrix.T) + 1))
    result[1:, 1:] = matrix
    result[0, 0] = corner
    return result


def _failure(reason: str) -> FlexcalError:
    return FlexcalError(
        "E-FIT-001",
        f"no physically feasible parameters were found (solver: {reason}); use --estimator wls to inspect the data.",
    )
