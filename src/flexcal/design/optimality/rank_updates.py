"""Selection of measurements by greedy start and exchange with low-rank updates (Fedorov 1972; Cook & Nachtsheim 1980).

For a block Θᵢ of r rows added (s = 1) or taken away (s = -1), with Kᵢ = Θᵢ M⁻¹ Θᵢᵀ the matrix determinant lemma gives
det M' = det M · det(1 + s Kᵢ), and the Woodbury identity tr(W M'⁻¹) = tr(W M⁻¹) - s tr((1 + s Kᵢ)⁻¹ Θᵢ M⁻¹ W M⁻¹ Θᵢᵀ). Both r × r
blocks are kept for every candidate and updated from one product (candidates · r, p) × (p, 2 r) a step; nothing is inverted again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.design.optimality.criteria import Criterion, DOptimal, SpectralCriterion, TraceOptimal
from flexcal.errors import FlexcalError
from flexcal.estimation import Sensitivity
from flexcal.progress import Progress, silent

POOL_REGULARISATION = 1e-5
"""Information of the whole pool, per candidate, added so that a set smaller than the parameters has a merit."""

SELECTION_STAGE = "choosing"
"""Name of the progress stage of exchanges."""

REBUILT = 8
"""Number of additions to a growing set after which its inverse is recomputed: early on every update loses digits."""


@dataclass(frozen=True, eq=False)
class Selection:
    """Selected candidates `chosen` (count,), in the order of choice, the `merit` of the set, and of every pass of exchanges."""

    chosen: np.ndarray
    merit: float
    history: tuple[float, ...]


def rank_exchange(
    sensitivity: Sensitivity,
    count: int,
    criterion: DOptimal | TraceOptimal,
    *,
    start: Sequence[int] | np.ndarray | None = None,
    passes: int = 20,
    progress: Progress = silent,
) -> Selection:
    """Exchange for criteria with low-rank updates; arguments, result and errors as of `exchange`."""
    check_selection(sensitivity, count, criterion, start)
    state = RankUpdates(sensitivity, criterion)
    chosen = [] if start is None else [int(i) for i in start]
    state.rebuild(chosen)
    progress(SELECTION_STAGE, 0.0)
    chosen = _grow(state, count, chosen)
    history = [state.merit]
    for number in range(passes):
        progress(SELECTION_STAGE, (number + 1) / (passes + 1))
        if not _exchange_once(state, chosen):
            break
        state.rebuild(chosen)
        history.append(state.merit)
    progress(SELECTION_STAGE, 1.0)
    return Selection(
        np.array(chosen), criterion.merit(_information(sensitivity, chosen, criterion)), tuple(history)
    )


def greedy(sensitivity: Sensitivity, count: int, criterion: DOptimal | TraceOptimal) -> Selection:
    """Greedy selection: nested sets grown by the best candidate each; the first k of `chosen` are the set of k."""
    check_selection(sensitivity, count, criterion, None, determine=False)
    state = RankUpdates(sensitivity, criterion)
    history: list[float] = []
    chosen: list[int] = []
    for _ in range(count):
        chosen = _grow(state, len(chosen) + 1, chosen)
        history.append(state.merit)
    return Selection(np.array(chosen), state.merit, tuple(history))


class RankUpdates:
    """Merit of a set of candidates under additions and removals of one.

    Inside, coordinates are those in which prior plus one average candidate has unit information, so that conditioning is that of the
    problem and not of its units.
    """

    def __init__(self, sensitivity: Sensitivity, criterion: DOptimal | TraceOptimal) -> None:
        jacobian = sensitivity.jacobian
        self.candidates, self.rows, self.size = jacobian.shape
        flat = jacobian.reshape(-1, self.size)
        pool = flat.T @ flat / self.candidates
        prior = sensitivity.prior_information if criterion.uses_prior else np.zeros((self.size, self.size))
        try:
            factor = np.linalg.cholesky(_symmetric(prior + pool))
        except np.linalg.LinAlgError as problem:
            raise FlexcalError(
                "E-DESIGN-016",
                "all candidates together leave a combination of parameters undetermined; reduce them to base parameters or give a prior.",
            ) from problem
        root = np.linalg.solve(factor, np.eye(self.size))
        self._flat = np.ascontiguousarray(flat @ root.T)
        self._offset = float(2 * np.log(np.diag(factor)).sum())
        self._start = _symmetric(root @ (prior + POOL_REGULARISATION * pool) @ root.T)
        self.trace_weight = root @ criterion.weight @ root.T if isinstance(criterion, TraceOptimal) else None
        self.rebuild([])

    def rebuild(self, chosen: Sequence[int]) -> None:
        """Recompute from a set, without the rounding of past updates."""
        members = self._block(list(chosen)).reshape(-1, self.size)
        information = self._start + members.T @ members
        factor = np.linalg.cholesky(information)
        root = np.linalg.solve(factor, np.eye(self.size))
        self.inverse = root.T @ root
        self.log_det = float(2 * np.log(np.diag(factor)).sum()) + self._offset
        self.weighted_inverse = self.inverse
        shape = (self.candidates, self.rows, self.size)
        seen = (self._flat @ self.inverse).reshape(shape)
        self.blocks = _products(seen, self._flat.reshape(shape))
        if self.trace_weight is not None:
            self.weighted_inverse = _symmetric(self.inverse @ self.trace_weight @ self.inverse)
            self.trace = float(np.sum(self.inverse * self.trace_weight))
            seen = (self._flat @ self.weighted_inverse).reshape(shape)
            self.weighted_blocks = _products(seen, self._flat.reshape(shape))

    @property
    def merit(self) -> float:
        """Merit of the current set."""
        return self.log_det / self.size if self.trace_weight is None else -0.5 * float(np.log(self.trace))

    def gains(self) -> np.ndarray:
        """Gains (candidates,) of adding each candidate: growth of log det M, or decline of the trace."""
        lead = np.moveaxis(self.blocks, 0, -1) + np.eye(self.rows)[:, :, None]
        if self.trace_weight is None:
            return np.log(_determinants(lead))
        return _solved_traces(lead, np.moveaxis(self.weighted_blocks, 0, -1))

    def add(self, candidate: int) -> None:
        """Add a candidate."""
        self._update(candidate, 1.0)

    def remove(self, candidate: int) -> None:
        """Remove a member."""
        self._update(candidate, -1.0)

    def copy_state(self) -> tuple[np.ndarray | float, ...]:
        """Copy of the state, for `restore`."""
        state = (self.inverse, self.weighted_inverse, self.log_det, self.blocks)
        return state if self.trace_weight is None else (*state, self.trace, self.weighted_blocks)

    def restore(self, state: tuple) -> None:
        """Restore a state of `copy_state`."""
        self.inverse, self.weighted_inverse, self.log_det, self.blocks = state[:4]
        if self.trace_weight is not None:
            self.trace, self.weighted_blocks = state[4:]

    def _block(self, candidates: list[int]) -> np.ndarray:
        return self._flat.reshape(self.candidates, self.rows, self.size)[candidates]

    def _update(self, candidate: int, sign: float) -> None:
        block = self._block([candidate])[0]
        lead = np.eye(self.rows) + sign * self.blocks[candidate]
        middle = np.linalg.solve(lead, np.eye(self.rows))
        self.log_det += float(np.linalg.slogdet(lead)[1])
        across = self.inverse @ block.T
        shape = (self.candidates, self.rows, self.rows)
        if self.trace_weight is None:
            seen = (self._flat @ across).reshape(shape)
            self.blocks = self.blocks - sign * _products(seen @ middle, seen)
            self.inverse = self.inverse - sign * (across @ middle @ across.T)
            return
        own = self.weighted_blocks[candidate]
        self.trace -= sign * float(np.sum(middle * own))
        wide = self.weighted_inverse @ block.T
        both = (self._flat @ np.hstack([across, wide])).reshape(self.candidates, self.rows, 2 * self.rows)
        seen, broad = both[:, :, : self.rows], both[:, :, self.rows :]
        turned = seen @ middle
        mixed = _products(turned, sign * broad - 0.5 * (turned @ own))
        self.blocks = self.blocks - sign * _products(turned, seen)
        self.weighted_blocks = self.weighted_blocks - mixed - np.swapaxes(mixed, 1, 2)
        scaled = across @ middle
        change = scaled @ (sign * wide - 0.5 * (scaled @ own)).T
        self.weighted_inverse = self.weighted_inverse - change - change.T
        self.inverse = self.inverse - sign * (scaled @ across.T)


def _grow(state: RankUpdates, count: int, chosen: list[int]) -> list[int]:
    """Add the best candidates until there are `count`; `state` holds those of `chosen`."""
    chosen = list(chosen)
    while len(chosen) < count:
        gains = state.gains()
        gains[chosen] = -np.inf
        chosen.append(int(np.argmax(gains)))
        state.add(chosen[-1])
        if len(chosen) % REBUILT == 0:
            state.rebuild(chosen)
    return chosen


def _exchange_once(state: RankUpdates, chosen: list[int]) -> int:
    """Replace each member by the best candidate; returns the number of members that changed."""
    changed = 0
    for place, member in enumerate(list(chosen)):
        before = state.copy_state()
        state.remove(member)
        gains = state.gains()
        own = gains[member]
        gains[chosen] = -np.inf
        best = int(np.argmax(gains))
        if gains[best] > own + 1e-9 * max(abs(own), 1e-9):
            state.add(best)
            chosen[place] = best
            changed += 1
        else:
            state.restore(before)
    return changed


def _information(sensitivity: Sensitivity, chosen: Sequence[int], criterion: Criterion) -> np.ndarray:
    rows = sensitivity.jacobian[np.asarray(chosen, dtype=int)].reshape(-1, len(sensitivity.parameters))
    information = rows.T @ rows
    return information + sensitivity.prior_information if criterion.uses_prior else information


def check_selection(
    sensitivity: Sensitivity,
    count: int,
    criterion: Criterion,
    start: Sequence[int] | np.ndarray | None,
    *,
    determine: bool = True,
) -> None:
    """Raise `FlexcalError` if `count` or `start` do not fit the candidates, or cannot determine the parameters."""
    candidates, rows, size = sensitivity.jacobian.shape
    if not 0 < count <= candidates:
        raise FlexcalError(
            "E-DESIGN-017", f"cannot choose {count} of {candidates} candidates; each serves once."
        )
    if start is not None:
        least = count if isinstance(criterion, SpectralCriterion) else 0
        if not least <= len(start) <= count or len(set(start)) < len(start):
            wanted = "exactly" if least else "at most"
            raise FlexcalError(
                "E-DESIGN-018",
                f"start holds {len(start)} candidates for a set of {count}; give {wanted} {count} different ones.",
            )
    known = np.linalg.matrix_rank(sensitivity.prior_information) if criterion.uses_prior else 0
    if determine and count * rows + known < size:
        raise FlexcalError(
            "E-DESIGN-019",
            f"{count} measurements of {rows} rows cannot determine {size} parameters; choose at least {-(-(size - known) // rows)}.",
        )


def _products(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """left · rightᵀ for every candidate: (candidates, r, p) twice to (candidates, r, r)."""
    return left @ np.swapaxes(right, 1, 2)


def _determinants(matrices: np.ndarray) -> np.ndarray:
    """Determinants (candidates,) of (r, r, candidates)."""
    if len(matrices) == 3:
        (a, b, c), (d, e, f), (g, h, i) = matrices
        return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return np.linalg.det(np.moveaxis(matrices, -1, 0))


def _solved_traces(lead: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """tr(lead⁻¹ · spread) (candidates,) of symmetric (r, r, candidates), lead positive."""
    if len(lead) == 3:
        (a, b, c), (_, e, f), (_, _, i) = lead
        (u, v, w), (_, x, y), (_, _, z) = spread
        aa, ab, ac = e * i - f * f, c * f - b * i, b * f - c * e
        bb, bc, cc = a * i - c * c, b * c - a * f, a * e - b * b
        return (aa * u + bb * x + cc * z + 2 * (ab * v + ac * w + bc * y)) / (a * aa + b * ab + c * ac)
    return np.trace(np.linalg.solve(np.moveaxis(lead, -1, 0), np.moveaxis(spread, -1, 0)), axis1=1, axis2=2)


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return (matrix + matrix.T) / 2
