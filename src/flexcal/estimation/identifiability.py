"""Identifiable parameters, and the linear combinations that absorb the others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.estimation.estimate import Dropped

RANK_TOLERANCE = 1e-9
"""Relative size of a diagonal of R that counts as zero: exact derivatives leave 1e-15, finite differences about 1e-8."""
_WEAK, _NAMED = 3, 0.2
"""Number of weak combinations shown; members below this share of the largest are not named."""
_ALIKE = 1e-8
"""Relative difference of the norms of two columns that is rounding."""


@dataclass(frozen=True, eq=False)
class Identifiability:
    """Rank of a column-scaled Jacobian and its regrouping.

    `kept` are column numbers in ascending order. `singular_values` (p,) and the |`diagonal`| of R (p,), relative to the
    largest, show how clear the `rank` is; the diagonal has the kept columns first, each part descending. `gap` is the
    number of decades between the last kept and the first dropped diagonal (inf without dropped ones). With x the
    parameters, `regrouping` (rank, p) @ x are the combinations that the kept parameters estimate: identity on the kept
    columns. `factor` (p, p) is the triangular factor of the scaled Jacobian.
    """

    names: tuple[str, ...]
    rank: int
    kept: tuple[int, ...]
    dropped: tuple[Dropped, ...]
    diagonal: np.ndarray
    gap: float
    regrouping: np.ndarray
    factor: np.ndarray

    @property
    def singular_values(self) -> np.ndarray:
        """Singular values (p,) of the scaled Jacobian, relative to the largest."""
        values = self._decomposition[0]
        return values / (np.max(values, initial=0.0) or 1.0)

    @property
    def directions(self) -> np.ndarray:
        """Right singular vectors (p, p) as rows, in units of the column scale."""
        return self._decomposition[1]

    @cached_property
    def _decomposition(self) -> tuple[np.ndarray, np.ndarray]:
        values, directions = np.linalg.svd(self.factor)[1:]
        return values, directions

    @property
    def kept_names(self) -> tuple[str, ...]:
        return tuple(self.names[i] for i in self.kept)

    def weak_directions(self, number: int = 3) -> tuple[tuple[float, str], ...]:
        """The weakest combinations: (singular value relative to the largest, name), the weakest first.

        Coefficients are in units of the column scale, in which parameters of any unit compare.
        """
        weakest = range(len(self.names) - 1, max(-1, len(self.names) - 1 - number), -1)
        return tuple(
            (float(self.singular_values[i]), name_direction(self.directions[i], self.names)) for i in weakest
        )

    def weak_seen_directions(self) -> tuple[tuple[str, float], ...]:
        """The three weakest combinations that are still seen: (name, singular value relative to the largest), the weakest first.

        Members below a fifth of the largest are not named.
        """
        weakest = range(self.rank - 1, max(-1, self.rank - 1 - _WEAK), -1)
        return tuple(
            (
                name_direction(self.directions[i], self.names, threshold=_NAMED),
                float(self.singular_values[i]),
            )
            for i in weakest
        )


def analyse(
    jacobian: np.ndarray,
    names: Sequence[str],
    *,
    scale: np.ndarray | None = None,
    prefer: Sequence[str] = (),
    tolerance: float = RANK_TOLERANCE,
) -> Identifiability:
    """Rank and regrouping of `jacobian` (m, p) by QR with column pivoting (Gautier 1991).

    Columns are multiplied by `scale` (p,), the size of a change that matters in each parameter; without it each gets unit
    norm. A column is dependent when what the kept ones leave of it is below `tolerance` times the largest. The parameters
    of `prefer` are tried first and in that order, so they are kept whenever they can be; the others by pivoting.
    A dropped column is J_d = J_k R₁₁⁻¹R₁₂, which names what absorbs it; contributions below 1e-6 of the largest, or
    below `tolerance`, are left out.
    Raises FlexcalError when shapes do not fit, a name is unknown or the Jacobian is not finite.
    """
    names = tuple(names)
    scaled, scale = _scaled(jacobian, names, scale)
    unknown = [name for name in prefer if name not in names]
    if unknown:
        raise FlexcalError("E-FIT-002", f"prefer names {unknown[0]}, which is no column of this Jacobian.")
    kept, dropped, diagonal = _select(scaled, [names.index(name) for name in prefer], tolerance)
    regrouping = np.zeros((len(kept), len(names)))
    regrouping[np.arange(len(kept)), kept] = 1.0
    described: list[Dropped] = []
    if dropped:
        share = _least_squares(scaled[:, kept], scaled[:, dropped])
        weight = np.abs(share) * np.linalg.norm(scaled[:, kept], axis=0)[:, None]
        limit = tolerance * np.max(np.linalg.norm(scaled, axis=0), initial=0.0)
        small = weight <= np.maximum(limit, 1e-6 * np.max(weight, axis=0, initial=0.0))
        coefficients = np.where(small, 0.0, share * scale[kept][:, None] / scale[dropped])
        regrouping[:, dropped] = coefficients
        for column, number in enumerate(dropped):
            order = [i for i in np.argsort(-np.abs(share[:, column])) if coefficients[i, column] != 0.0]
            absorbed = tuple((names[kept[i]], float(coefficients[i, column])) for i in order)
            described.append(Dropped(names[number], absorbed))
    largest = np.max(diagonal, initial=0.0) or 1.0
    first_dropped = np.max(diagonal[len(kept) :], initial=0.0)
    last_kept = np.min(diagonal[: len(kept)], initial=math.inf)
    gap = math.log10(last_kept / first_dropped) if kept and first_dropped > 0 else math.inf
    return Identifiability(
        names=names,
        rank=len(kept),
        kept=tuple(kept),
        dropped=tuple(described),
        diagonal=diagonal / largest,
        gap=gap,
        regrouping=regrouping,
        factor=scaled,
    )


def name_direction(vector: np.ndarray, names: Sequence[str], *, threshold: float = 0.05) -> str:
    """A readable combination such as "0.71 joint_2.offset - 0.70 joint_3.offset", largest first, its sign chosen positive.

    Scaled to unit norm; components below `threshold` times the largest are left out.
    """
    vector = np.asarray(vector, dtype=float)
    norm = float(np.linalg.norm(vector))
    if norm == 0.0:
        return "0"
    order = np.argsort(-np.abs(vector), kind="stable")
    vector = vector / (norm * math.copysign(1.0, vector[order[0]]))
    text = f"{vector[order[0]]:.2f} {names[order[0]]}"
    for i in order[1:]:
        if abs(vector[i]) < threshold * vector[order[0]]:
            break
        text += f" {'-' if vector[i] < 0 else '+'} {abs(vector[i]):.2f} {names[i]}"
    return text


def _scaled(
    jacobian: np.ndarray, names: tuple[str, ...], scale: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """The triangular factor (p, p) of the column-scaled Jacobian, and the scale (p,) used."""
    jacobian = np.asarray(jacobian, dtype=float)
    size = len(names)
    if jacobian.ndim != 2 or jacobian.shape[1] != size:
        raise FlexcalError(
            "E-FIT-003", f"The Jacobian has shape {jacobian.shape}; {size} names need (rows, {size})."
        )
    if not np.all(np.isfinite(jacobian)):
        bad = names[int(np.argmin(np.all(np.isfinite(jacobian), axis=0)))]
        raise FlexcalError(
            "E-FIT-004", f"The Jacobian's column for {bad} is not finite; check the model there."
        )
    if scale is None:
        norms = np.linalg.norm(jacobian, axis=0)
        scale = 1.0 / np.where(norms > 0, norms, 1.0)
    scale = np.asarray(scale, dtype=float)
    if scale.shape != (size,) or not np.all(scale > 0) or not np.all(np.isfinite(scale)):
        raise FlexcalError(
            "E-FIT-005", f"scale must hold one positive number for each of the {size} columns."
        )
    factor = np.asarray(np.linalg.qr(jacobian * scale, mode="r"))
    padded = np.zeros((size, size))
    padded[: factor.shape[0]] = factor
    return padded, scale


def _select(
    scaled: np.ndarray, preferred: Sequence[int], tolerance: float
) -> tuple[list[int], list[int], np.ndarray]:
    """Columns to keep and to drop, both ascending, and the |diagonal| of R with the kept first, each part descending.

    Modified Gram-Schmidt, each direction projected out twice, which is as accurate as reflections.
    """
    remainder = np.array(scaled)
    limit = tolerance * np.max(np.linalg.norm(scaled, axis=0), initial=0.0)
    kept: list[int] = []
    sizes: list[float] = []

    def take(column: int) -> None:
        sizes.append(float(np.linalg.norm(remainder[:, column])))
        direction = remainder[:, column] / sizes[-1]
        for _ in range(2):
            remainder[...] -= direction[:, None] * (direction @ remainder)
        remainder[:, column] = 0.0

    for column in preferred:
        if column not in kept and np.linalg.norm(remainder[:, column]) > limit:
            kept.append(column)
            take(column)
    rest = [i for i in range(scaled.shape[1]) if i not in kept]
    chosen: list[int] = []
    for _ in rest:
        norms = np.linalg.norm(remainder, axis=0)
        # of columns of one size the first: rounding must not choose, as by the order of the rows
        largest = int(np.argmax(norms >= (1 - _ALIKE) * norms.max()))
        if norms[largest] == 0.0:
            break
        if norms[largest] > limit:
            chosen.append(largest)
        take(largest)
    kept += chosen
    left = [*sizes[len(kept) :], *[0.0] * (scaled.shape[1] - len(sizes))]
    dropped = [i for i in range(scaled.shape[1]) if i not in kept]
    return sorted(kept), dropped, np.array(sorted(sizes[: len(kept)], reverse=True) + left)


def _least_squares(kept: np.ndarray, dropped: np.ndarray) -> np.ndarray:
    """R₁₁⁻¹ R₁₂ for the columns `kept` (p, k) and `dropped` (p, d)."""
    if kept.shape[1] == 0:
        return np.zeros((0, dropped.shape[1]))
    basis, factor = np.linalg.qr(kept)
    return np.linalg.solve(factor, basis.T @ dropped)
