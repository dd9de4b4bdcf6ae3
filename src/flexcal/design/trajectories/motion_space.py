"""Motions of all joints linear in their coordinates: periodic, from rest to rest, or of some joints only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from flexcal.data.plans import fourier_basis, spline_basis
from flexcal.design.trajectories.limit_usage import MotionLimits

Kind = Literal["fourier", "spline"]
_DAMPING = 0.3


@dataclass(frozen=True, eq=False)
class MotionSpace:
    """Coefficients (c, n) of paths = `fixed` + `free` (c, k) · `scale` · coordinates (k, n), seen at `instants` of one `period`, s.

    `size` is the number of harmonics or control points. A coordinate is about one where it takes what the joint allows. With `placed` the
    first one is the place about which a joint moves, beginning with `fixed` without.
    """

    kind: Kind
    size: int
    period: float
    instants: int
    free: np.ndarray
    fixed: np.ndarray
    scale: np.ndarray
    placed: bool

    @classmethod
    def of(
        cls,
        kind: Kind,
        size: int,
        period: float,
        instants: int,
        limits: MotionLimits,
        *,
        rest: bool = False,
        start: np.ndarray | None = None,
    ) -> MotionSpace:
        """Motions of all joints; with `rest` they begin and end at rest, with `start` (n,) there."""
        standing = np.ones(size) if kind == "spline" else np.eye(1 + 2 * size)[0]
        begin = _basis(kind, np.zeros(1), period, size)[:, 0]
        rows = [standing, *(begin[1:] if rest else ()), *(begin[:1] if start is not None else ())]
        swings = _null_space(np.array(rows))
        n = len(limits.lower)
        free = swings if start is not None else np.column_stack([standing, swings])
        fixed = np.zeros((len(standing), n)) if start is None else np.outer(standing, start)
        reach = (limits.upper - limits.lower) / 2
        fastest = np.abs(_basis(kind, np.arange(instants) * period / instants, period, size) @ swings).max(
            axis=1
        )
        allowed = np.minimum(reach / fastest[0][:, None], limits.velocity / fastest[1][:, None])
        scale = allowed if start is not None else np.vstack([reach, allowed])
        return cls(kind, size, period, instants, free, fixed, scale, start is None)

    def moving(self, joints: Sequence[int]) -> MotionSpace:
        """Motions of these joints only; the others stay at their place."""
        swings = self.scale[1:] if self.placed else self.scale
        standing = np.isin(np.arange(self.joints), list(joints), invert=True)
        still = np.where(standing, 0.0, swings)
        return replace(self, scale=np.vstack([self.scale[:1], still]) if self.placed else still)

    @property
    def joints(self) -> int:
        return self.fixed.shape[1]

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the coordinates."""
        return self.free.shape[1], self.joints

    @cached_property
    def _basis(self) -> np.ndarray:
        time = np.arange(self.instants) * self.period / self.instants
        return _basis(self.kind, time, self.period, self.size)

    @cached_property
    def _maps(self) -> tuple[np.ndarray, np.ndarray]:
        return self._basis @ self.free, self._basis @ self.fixed

    def place(self, q: np.ndarray) -> np.ndarray:
        """The first coordinates (n,) of a motion about `q` (n,)."""
        return q / self.scale[0]

    def still(self, x: np.ndarray) -> np.ndarray:
        """Flat coordinates of rest at the place of the motion `x`."""
        place = np.zeros(self.shape)
        if self.placed:
            place[0] = x.reshape(self.shape)[0]
        return place.ravel()

    def coefficients(self, x: np.ndarray) -> np.ndarray:
        """Coefficients (c, n) of the paths."""
        return self.fixed + self.free @ (self.scale * x.reshape(self.shape))

    def motion(self, x: np.ndarray) -> np.ndarray:
        """Motion q, q̇, q̈ (3, instants, n)."""
        linear, constant = self._maps
        return linear @ (self.scale * x.reshape(self.shape)) + constant

    def by_coordinates(self, by_motion: np.ndarray) -> np.ndarray:
        """Derivative by the flat coordinates, from that by the motion (3, instants, n)."""
        return (self.scale * np.sum(self._maps[0].transpose(0, 2, 1) @ by_motion, axis=0)).ravel()

    def solver(self, weights: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """The inverse of Σ basisᵀ weights basis, `weights` (3, instants, n), joint by joint, times flat coordinates; slightly damped."""
        maps = self._maps[0]

        def solve(vector: np.ndarray) -> np.ndarray:
            values = vector.reshape(self.shape)
            solution = np.empty_like(values)
            for joint in range(self.joints):
                scaled = maps * self.scale[:, joint]
                size = np.einsum("dik,di,dil->kl", scaled, weights[:, :, joint], scaled, optimize=True)
                size[np.diag_indices_from(size)] += _DAMPING
                solution[:, joint] = np.linalg.solve(size, values[:, joint])
            return solution.ravel()

        return solve

    def finer(self, factor: int) -> MotionSpace:
        """Same motions at more instants."""
        return replace(self, instants=factor * self.instants)


def _basis(kind: Kind, time: np.ndarray, period: float, size: int) -> np.ndarray:
    of = fourier_basis if kind == "fourier" else spline_basis
    return of(time, period, size)


def _null_space(rows: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the null space, in columns."""
    return np.linalg.svd(rows)[2][np.linalg.matrix_rank(rows) :].T
