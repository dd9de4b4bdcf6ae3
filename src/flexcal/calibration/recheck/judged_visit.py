"""Judgement of a visit: as calibrated, one change that explains the errors and no other does about as well, or neither."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.recheck.another_geometry import CLEAR, for_another_geometry
from flexcal.calibration.recheck.change_effects import (
    OF_THE_MEASUREMENT,
    PossibleChange,
    drift_of_readings,
    noisier_readings,
    possible_changes,
    worn_gears,
    wrong_readings,
)
from flexcal.calibration.recheck.cumulative_sums import ShiftAtVisit
from flexcal.calibration.recheck.global_test import (
    ALIKE,
    FALSE_ALARM,
    VISIT_ALARM,
    GlobalTest,
    SeenChange,
    seen_change,
)
from flexcal.calibration.recheck.pairs_of_changes import FittedPair, pairs_of_changes, two_changes
from flexcal.calibration.recheck.scatter_of_visit import (
    LARGEST,
    LargerScatter,
    scatter_about,
    scatter_alone,
    unexplained,
)
from flexcal.calibration.recheck.visit_errors import VisitErrors
from flexcal.estimation import student_quantile

_LARGE = 1e-4
"""Shift of a joint, rad or m, above which the points do not move in proportion to it."""
_STEPS = 4
_NO_WARMTH = 3e-3
"""Growth, m/m, that no temperature makes: 250 K of steel."""
_EVIDENT = 0.1
"""Share of the errors that an instrument that moved may leave where something else changed too."""
_BY_CHANCE = 0.05
"""Probability that two changes seem likelier than the single one that is true."""
_LEAST = 12
"""Least number of coordinates for which the place of the instrument is fitted without being asked."""


@dataclass(frozen=True, eq=False)
class Suspect:
    """A change that explains the errors of a visit.

    Attributes
    ----------
    change : PossibleChange
        What changed.
    estimate, std : ndarray
        By how much (k,), in the units of the change, and standard deviations.
    covariance : ndarray
        Their covariance (k, k).
    quantile : float
        Half-width of their 95 % intervals in standard deviations (Student).
    remainder : float
        Probability that chance leaves what the change does not explain.
    score : float
        Twice the negative log-likelihood, with what Schwarz's criterion adds for the parameters and for the number of changes of the kind.
    cost : float
        Twice the negative log-likelihood alone.
    misfit : float
        Sum of squares that the change leaves, whitened.
    parameters : float
        Effective number of parameters, with those of an effect that is uncertain.
    same : bool
        Whether its effect at these points cannot be told from that of the best suspect, which is part of it.
    """

    change: PossibleChange
    estimate: np.ndarray
    std: np.ndarray
    covariance: np.ndarray
    quantile: float
    remainder: float
    score: float
    cost: float
    misfit: float
    parameters: float
    same: bool = False


@dataclass(frozen=True, eq=False)
class JudgedVisit:
    """Judgement of a visit.

    Attributes
    ----------
    test : GlobalTest
        The test whether the robot is as calibrated, and what it sees.
    probability : float
        That chance makes errors as conspicuous.
    suspects : tuple of Suspect
        Where the test rejects, changes that explain the errors about equally well, the best first; empty where none does.
    together : float
        Probability that chance leaves what all changes together do not explain.
    shifts : tuple of Suspect
        Every change of one parameter, as if it were the only one, whatever the verdict.
    instrument : {"known", "declared", "evident"}
        Why the place of the instrument was fitted to the visit, if it was.
    place : Suspect or None
        Where the instrument stands then, where that alone explains the errors.
    scatter : LargerScatter or None
        By how much the readings scatter more than was assumed, where the test rejects and they do; the test and suspects are then by it.
    geometry : bool
        Whether many differences of the geometry, as of another robot, explain the errors about as well as scatter or suspects do; where
        there is neither, far better.
    rivals : FittedPair or None
        Where the instrument stands elsewhere and nothing else changed, or no single change explains the errors, two changes of the robot
        that together do.
    """

    test: GlobalTest
    probability: float
    suspects: tuple[Suspect, ...]
    together: float
    shifts: tuple[Suspect, ...]
    instrument: str = "known"
    place: Suspect | None = None
    scatter: LargerScatter | None = None
    geometry: bool = False
    rivals: FittedPair | None = None

    @property
    def as_calibrated(self) -> bool:
        """Whether nothing speaks against what the visit is compared with, at the false alarms of a visit."""
        return self.probability > VISIT_ALARM

    @property
    def verdict(self) -> str:
        """One of as_calibrated, the kinds of changes, ambiguous (of several kinds or joints), noisier_readings and recalibrate."""
        if self.as_calibrated:
            return "instrument_moved" if self.instrument == "evident" else "as_calibrated"
        if not self.suspects:
            return "recalibrate" if self.scatter is None else "noisier_readings"
        return self.suspects[0].change.kind if len(self.suspects) == 1 else "ambiguous"

    def at_visit(self, series: str) -> tuple[ShiftAtVisit, ...]:
        """Shifts of single joints, of all lengths and of the payload with the part of their variance that visits of a `series` share."""
        result = []
        for suspect in self.shifts:
            if suspect.change.kind == "joint_softer":
                continue
            item = next(seen for seen in self.test.seen if seen.change is suspect.change)
            weights = (item.columns.T @ self.test.whitening)[0] * suspect.covariance[0, 0]
            own, common = (
                float(np.sqrt(weights @ part @ weights))
                for part in (self.test.errors.own, self.test.errors.common)
            )
            result.append(
                ShiftAtVisit(suspect.change.subject, float(suspect.estimate[0]), own, common, series)
            )
        return tuple(result)


def judge_visit(errors_of: Callable[[bool], VisitErrors | None], *, placed: bool) -> JudgedVisit | None:
    """Judge the errors of a visit that `errors_of` gives, its argument being whether the place of the instrument is fitted.

    Where that was not `placed` and the errors are those of an instrument that stands elsewhere, it is fitted then. None where `errors_of`
    gives none.
    """
    errors = errors_of(placed)
    if errors is None:
        return None
    judged = _judge(errors)
    if placed:
        return replace(judged, instrument="declared")
    alone = [suspect.change.kind for suspect in judged.suspects] == ["instrument_moved"]
    if judged.as_calibrated or (judged.suspects and not alone) or judged.verdict == "noisier_readings":
        return judged
    again = errors_of(True)
    if again is None or again.errors.size < _LEAST:
        return judged
    moved = _judge(again)
    # an instrument that moved leaves nothing else; errors that remain have another cause, unless they are a small part of the whole
    before = float(np.sum((judged.test.whitening @ errors.errors) ** 2))
    after = float(np.sum((moved.test.whitening @ again.errors) ** 2))
    explained = moved.suspects and moved.scatter is None and after < _EVIDENT * before
    explained = explained or (len(moved.suspects) == 1 and is_no_warmth(moved.suspects[0]))
    if moved.as_calibrated or explained:
        rivals = two_changes(judged.test) if moved.as_calibrated else None
        return replace(
            moved, instrument="evident", place=judged.suspects[0] if alone else None, rivals=rivals
        )
    return judged


def is_no_warmth(suspect: Suspect) -> bool:
    """Whether all lengths are others by more than any temperature makes: by 250 K of steel."""
    return suspect.change.kind == "thermal_growth" and abs(float(suspect.estimate[0])) > _NO_WARMTH


def _judge(errors: VisitErrors) -> JudgedVisit:
    changes = possible_changes(errors.model, errors.at)
    test = GlobalTest.of(errors, changes)
    probability = test.probability(errors.errors)
    shifts = tuple(_suspect(test, item, 1) for item in test.seen if len(item.change.names) == 1)
    together = _together(test)
    if probability > VISIT_ALARM:
        return JudgedVisit(test, probability, (), together, shifts)
    found = _explanations(test)
    suspects = _suspects(found)
    # play is a step where a compliance is a slope, over the same gravity torques
    yields = any(suspect.change.kind in ("joint_softer", "payload_changed") for suspect in suspects)
    worn = _worn(test) if yields or not suspects else []
    suspects = _suspects([*found, *worn]) if yields else suspects or _suspects(worn)
    pair = _pair(test, found, suspects)
    explained = [(suspect.misfit, item.basis.shape[1]) for item, suspect in (*found, *worn, *pair)]
    other = for_another_geometry(test, explained)
    if other > CLEAR:
        return JudgedVisit(test, probability, (), together, shifts, geometry=True, rivals=two_changes(test))
    suspects = tuple(sorted((*suspects, *(suspect for _, suspect in pair)), key=lambda s: s.score))
    rivals = None if suspects else two_changes(test)
    remainders = [suspect.remainder for _, suspect in (*found, *worn)]
    scatter = scatter_about(test, remainders, together)
    if scatter is None:
        scatter, noise = _noise(test)
        best = min(suspect.score for _, suspect in (*found, *worn, *pair))
        best = best if rivals is None else min(best, rivals.score(test))
        if scatter is None or noise.score > best:
            if suspects and scatter is not None and noise.score < best + ALIKE:
                suspects = tuple(sorted((*suspects, noise), key=lambda s: s.score))
            return JudgedVisit(
                test, probability, suspects, together, shifts, geometry=other > 0, rivals=rivals
            )
    # causes by the scatter that the visit has; what that explains is none
    wider = GlobalTest.of(scatter.applied(errors), changes, directed=True)
    caused = wider.probability(errors.errors) <= VISIT_ALARM
    suspects = _suspects(_explanations(wider)) if caused else ()
    if caused and not suspects:  # scatter is not it: more changed, or this is another robot
        return JudgedVisit(test, probability, (), together, shifts, rivals=two_changes(test))
    shifts = tuple(_suspect(wider, item, 1) for item in wider.seen if len(item.change.names) == 1)
    return JudgedVisit(
        wider,
        probability,
        suspects,
        together,
        shifts,
        scatter=scatter,
        geometry=other > -CLEAR,
        rivals=None if suspects else rivals,
    )


def _noise(test: GlobalTest) -> tuple[LargerScatter | None, Suspect]:
    """More scatter of the readings as if nothing else were the cause; no scatter where it is too large for noise."""
    scatter, cost = scatter_alone(test)
    std = np.array([scatter.std])
    suspect = Suspect(
        noisier_readings(len(test.errors.poses)),
        np.array([scatter.factor]),
        std,
        np.diag(std**2),
        1.96,
        1.0,
        cost + float(np.log(test.size)),
        cost,
        float(test.size),
        1.0,
    )
    return scatter if scatter.factor < LARGEST else None, suspect


def _together(test: GlobalTest) -> float:
    left, count = unexplained(test)
    return float(test.chance(left, count)) if count > 0 else 1.0


def _explanations(test: GlobalTest) -> list[tuple[SeenChange, Suspect]]:
    """Every change, a drift of the readings, and a wrong reading of each pose, as if it alone were the cause."""
    errors = test.errors
    root = np.linalg.cholesky(errors.covariance)
    others = [
        seen_change(change, test.whitening, root)
        for change in (
            drift_of_readings(len(errors.poses)),
            *wrong_readings(len(errors.poses), errors.poses.pose),
        )
    ]
    every = [*test.seen, *(item for item in others if item.seen and item.basis.shape[1] < test.size)]
    kinds = [item.change.kind for item in every]
    return [(item, _suspect(test, item, kinds.count(item.change.kind))) for item in every]


def _worn(test: GlobalTest) -> list[tuple[SeenChange, Suspect]]:
    """Play of every gear as if it alone were the cause; gaps are not negative."""
    errors = test.errors
    root = np.linalg.cholesky(errors.covariance)
    gears = [seen_change(change, test.whitening, root) for change in worn_gears(errors.model, errors.at)]
    found = [(item, _suspect(test, item, len(gears))) for item in gears if item.seen]
    return [(item, suspect) for item, suspect in found if suspect.estimate[0] > 0]


def _pair(
    test: GlobalTest, found: list[tuple[SeenChange, Suspect]], suspects: tuple[Suspect, ...]
) -> list[tuple[SeenChange, Suspect]]:
    """Two changes at once, where they are likelier than the best single one beyond chance; empty where they are not.

    Were a single change the true one, the best pair would gain more over it than this limit in at most 5 % of visits (χ², Bonferroni's
    inequality over the pairs).
    """
    from scipy.special import chdtri

    if not suspects or suspects[0].change.kind in OF_THE_MEASUREMENT:
        return []
    best = suspects[0]
    item = next((seen for seen, suspect in found if suspect.change is best.change), None)
    if item is None:  # play in a gear
        return []
    root = _effect_root(test, best.change, best.estimate)
    values = _left(test, item, best.estimate) + item.columns @ best.estimate
    pairs = pairs_of_changes(test, root, values)
    if not pairs:
        return []
    likeliest = min(pairs, key=lambda pair: pair.misfit + pair.rank * np.log(test.size))
    whole = np.linalg.cholesky(test.errors.covariance)
    both = seen_change(PossibleChange.of_two(*likeliest.changes), test.whitening, whole)
    suspect = _suspect(test, both, len(pairs))
    further = max(likeliest.rank - item.basis.shape[1], 1)
    beyond = best.cost - suspect.cost > float(chdtri(further, _BY_CHANCE / len(pairs)))
    return [(both, suspect)] if beyond and suspect.remainder > FALSE_ALARM else []


def _suspects(found: list[tuple[SeenChange, Suspect]]) -> tuple[Suspect, ...]:
    """Those that explain the errors, and are not excluded by the best of them, the best first."""
    fitting = [pair for pair in found if pair[1].remainder > FALSE_ALARM]
    if not fitting:
        return ()
    best_item, best = min(fitting, key=lambda pair: pair[1].score)
    # alike: as likely with all that the criterion adds; not told from the best by the errors themselves; or a change of more parameters
    # of which the best one is a part
    alike = [best]
    for item, suspect in found:
        if suspect is best:
            continue
        if suspect.remainder <= FALSE_ALARM:
            # what an uncertain effect explains may be that of another change, however little chance leaves of it
            if best.change.spread is not None and _not_excluded(suspect, item, best, best_item, len(found)):
                alike.append(suspect)
            continue
        same = _contains(item, best_item)
        if (
            same
            or suspect.score < best.score + ALIKE
            or _not_excluded(suspect, item, best, best_item, len(found))
        ):
            alike.append(replace(suspect, same=same or _contains(best_item, item)))
    return tuple(sorted(alike, key=lambda s: s.score))


def _not_excluded(
    suspect: Suspect, item: SeenChange, best: Suspect, best_item: SeenChange, alternatives: int
) -> bool:
    """Whether the errors may be those of a change of the robot although another explains them best.

    Were it the true one, the best of all alternatives would gain more over it than this limit in at most 1 % of visits: what a change
    adds to the true one is χ² of its parameters, and Bonferroni's inequality counts the alternatives.
    """
    from scipy.special import chdtri

    if suspect.change.kind == "wrong_reading" or item.basis.shape[1] > best_item.basis.shape[1]:
        return False
    gain = suspect.cost - best.cost
    return gain < float(chdtri(best.parameters, FALSE_ALARM / alternatives))


def _contains(larger: SeenChange, smaller: SeenChange) -> bool:
    """Whether every effect of one change is one of another."""
    left = smaller.basis - larger.basis @ (larger.basis.T @ smaller.basis)
    return bool(np.linalg.norm(left, axis=0).max(initial=0.0) < 1e-3)


def _suspect(test: GlobalTest, item: SeenChange, alternatives: int) -> Suspect:
    """A change fitted alone: joints by Gauss-Newton, as their effect is not in proportion to a large shift, and columns that are uncertain
    with the covariance of the effect that is estimated (iterated generalised least squares).
    """
    change = item.change
    inverse = _inverse(item.columns)
    estimate = inverse @ (test.whitening @ test.errors.errors)
    if change.spread_at(np.ones_like(estimate)).size > 0 or _is_large(change, estimate):
        for _ in range(_STEPS):
            left = _left(test, item, estimate)
            root = _effect_root(test, change, estimate)
            inverse = _inverse(np.linalg.solve(root, item.columns))
            estimate = estimate + inverse @ np.linalg.solve(root, left)
    left = _left(test, item, estimate)
    root = _effect_root(test, change, estimate)
    misfit = float(np.sum(np.linalg.solve(root, left) ** 2))
    rank = item.basis.shape[1]
    count = test.size - rank
    remainder = float(test.chance(misfit, count)) if count > 0 else 1.0
    freedom = test.freedom
    cost = test.cost(misfit) + 2 * float(np.log(np.diag(root)).sum())
    covariance = inverse @ inverse.T
    return Suspect(
        change,
        estimate,
        np.sqrt(np.diag(covariance)),
        covariance,
        student_quantile(0.975, freedom) if np.isfinite(freedom) else 1.96,
        remainder,
        cost + rank * float(np.log(test.size)) + 2 * float(np.log(alternatives)),
        cost,
        misfit,
        rank + test.size - float(np.sum(np.linalg.inv(root) ** 2)),
    )


def _effect_root(test: GlobalTest, change: PossibleChange, estimate: np.ndarray) -> np.ndarray:
    """Cholesky factor (m, m) of the covariance of the whitened errors with that of the effect of an `estimate` (k,)."""
    spread = test.whitening @ change.spread_at(estimate)
    return np.linalg.cholesky(np.eye(test.size) + spread @ spread.T)


def _inverse(columns: np.ndarray) -> np.ndarray:
    """Pseudo-inverse (k, m) of columns of any scale."""
    scale = np.linalg.norm(columns, axis=0)
    inverse = np.linalg.pinv(columns / np.where(scale > 0, scale, 1.0), rcond=1e-6)
    return inverse / np.where(scale > 0, scale, np.inf)[:, None]


def _shifts(change: PossibleChange) -> list[int]:
    """Which of its parameters are shifts of joints."""
    return [k for k, name in enumerate(change.names) if name.endswith(".offset")]


def _is_large(change: PossibleChange, estimate: np.ndarray) -> bool:
    """Whether joints shift by so much that the points do not move in proportion."""
    return bool(np.abs(estimate[_shifts(change)]).max(initial=0.0) > _LARGE)


def _left(test: GlobalTest, item: SeenChange, estimate: np.ndarray) -> np.ndarray:
    """Whitened errors (m,) beside a change by `estimate` (k,)."""
    errors, shifts = test.errors, _shifts(item.change)
    if not _is_large(item.change, estimate):
        return test.whitening @ errors.errors - item.columns @ estimate
    names = [item.change.names[k] for k in shifts]
    moved = {
        name: errors.model.value(name) + float(estimate[k]) for name, k in zip(names, shifts, strict=True)
    }
    rest = np.delete(np.arange(len(estimate)), shifts)
    return test.whitening @ errors.with_values(moved) - item.columns[:, rest] @ estimate[rest]
