"""Selection of terms beyond the kinematic ones by cross-validation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.error_model import order_folds, repeated_pose_numbers, workspace_folds
from flexcal.calibration.fit import (
    LEAST_COORDINATES,
    LEAST_POSES,
    THERMAL,
    GeometricFit,
    coordinates,
    enough_for_terms,
    fit_geometry,
)
from flexcal.calibration.measurement import Readings
from flexcal.calibration.term_selection.candidates import candidates
from flexcal.calibration.term_selection.trials import TermComparison, TermTrials, not_tried
from flexcal.data.poses import PoseSet
from flexcal.model.robot import RobotModel

CONDITIONAL = (
    "Intervals take the terms that cross-validation chose for known: where an effect is at the limit of what the poses show, 95 % "
    "intervals hold in about 93 % of simulated cases."
)
"""What 95 % intervals after the selection leave out, with the share of simulated cases in which they hold
(tests/jobs/test_yielding_robot.py).
"""
FOLDS = 8
FINER = {"thermal_links": "thermal"}
"""Terms that say in more detail what another one says, and are tried where that was taken."""
_INSTRUMENT, _LINKS = "thermal_stations", "thermal_links"
"""Terms that look alike where the links warm up differently: a base column that grows lifts the arm as an instrument that sinks does."""
MANY_POSES = 10 * FOLDS
"""Number of different poses from which whole folds are left out rather than single poses."""


@dataclass(frozen=True, eq=False)
class TermSelection:
    """Result of the selection: `terms` supported by cross-validation, for a `model` that declares them, and every term `considered`.

    `by` says what was left out: "poses" one by one, "folds", or "places" of a fixture; "nothing"
    where there are too few, as `remark` then says.
    """

    terms: tuple[str, ...]
    model: RobotModel
    considered: tuple[TermComparison, ...]
    by: str
    remark: str

    def without(self, term: str, model: RobotModel, reason: str) -> TermSelection:
        """Selection for a `model` without a term that was taken and cannot be fitted, for the `reason`, a clause."""
        rows = (
            replace(row, taken=False, reason=f"{row.reason}; but {reason}") if row.term == term else row
            for row in self.considered
        )
        kept = tuple(own for own in self.terms if own != term)
        return replace(self, terms=kept, model=model, considered=tuple(rows))

    def __str__(self) -> str:
        return "; ".join(
            f"{row.term}: {'taken' if row.taken else 'left'}, {row.reason}"
            for row in self.considered
            if row.term
        )


@dataclass(frozen=True)
class CrossValidation:
    """Cross-validated `mean` error (m): `by` "poses", left out one by one, "folds", the larger of both kinds, or "places" of a fixture.

    `freedom` is the number of parameters of the fit, the trace of its hat matrix. `expected` (m) is the mean error to expect from what the
    fit leaves at its own poses: that times the ratio of both for independent errors with the scatter of every reading.
    """

    by: str
    mean: float
    freedom: float
    expected: float


def cross_validated(fit: GeometricFit) -> CrossValidation | None:
    """Cross-validation of a fit with all its terms, linearised and without its outliers; None with few poses (`enough_for_terms`), unless
    all parameters have a prior.
    """
    rows = np.setdiff1d(np.arange(len(fit.poses)), list(fit.estimate.outliers))
    inside = replace(
        fit, poses=fit.poses.subset(rows), readings=fit.readings[np.isin(Readings.of(fit.poses).row, rows)]
    )
    folds, distinct = folds_of(inside.poses)
    if not enough_for_terms(inside.poses) and not fit.by_prior:
        return None
    by = left_out_by(inside.poses, distinct)
    trials = TermTrials(inside, fit.model, fit.terms, folds, by=by)
    left = trials.decided(fit.terms)
    growth = left.expected.mean() / left.expected_fitted.mean()
    mean = max(float(distance.mean()) for distance in left.distances)
    return CrossValidation(by, mean, left.freedom, float(growth * left.fitted.mean()))


def folds_of(poses: PoseSet) -> tuple[tuple[np.ndarray, ...], int]:
    """Folds (N,) in measuring order, in the workspace, and of single poses, and the number of single poses."""
    alone = repeated_pose_numbers(poses.q)
    held = poses.in_socket
    order = order_folds(len(poses), FOLDS)
    workspace = workspace_folds(poses.position if poses.located.all() else poses.q[:, :3], FOLDS)
    if held.any():
        # a place of a fixture is left out with all its rows: the rest of them would tell where it stands
        place = FOLDS + np.unique(poses.station, return_inverse=True)[1]
        order, workspace = np.where(held, place, order), np.where(held, place, workspace)
    folds = (order, workspace, alone)
    return folds, len(np.unique(alone))


def left_out_by(poses: PoseSet, distinct: int) -> str:
    """What decides: errors at "places" of a fixture, at "folds", or at single "poses" where few are `distinct`."""
    if distinct < MANY_POSES:
        return "poses"
    return "places" if poses.in_socket.all() else "folds"


def select_terms(
    model: RobotModel,
    poses: PoseSet,
    fitted: GeometricFit | None = None,
    assumed: tuple[str, ...] = (),
) -> TermSelection:
    """Forward selection of compliance under gravity, backlash and transmission harmonics on top of the rigid fit.

    A term is added where it lowers the mean error on poses left out by more than one standard error of the paired difference, lowers the
    Bayesian information criterion, and does not raise the largest left-out error. Fewer than 80 different poses are left out one by one,
    more in folds contiguous in measuring order and in the workspace, where both must agree. Fits are linear, about the fit of the base
    terms to all poses by squares. Compliances that are not supported for all joints are tried joint by joint, and must then lower the
    criterion by 2 log(number of such candidates) more (Chen and Chen 2008). Fewer than 20 different poses, or 60
    coordinates, support no choice.

    `fitted` is a fit of the base terms to these poses, or more, without springs: where there is one it is the one, or its start. `assumed`
    are terms that are fitted by their prior in any case.

    Where a change of the instrument with temperature was taken and the expansion of single links explains the points about as well, that is
    taken in its place: it is the robot's, and compensation needs it.

    The random effects `transmission` are none of the terms: beside them compliance of every joint, which moves the points much alike,
    would not be found.
    """
    base = ("kinematic", *(("backlash",) if model.backlash_joints else ()))
    folds, distinct = folds_of(poses)
    if not enough_for_terms(poses):
        return TermSelection((*base, *assumed), model, (), "nothing", _too_few(poses, distinct, assumed))
    if fitted is not None and len(fitted.poses) == len(poses) and not model.elastic:
        rigid = fitted
    else:
        near = None if fitted is None else fitted.estimate.values
        rigid = fit_geometry(model, poses, terms=base, elastic=bool(model.elastic), loss="squares", near=near)
    open_terms = candidates(model, poses)
    by = left_out_by(poses, distinct)
    trials = TermTrials(rigid, open_terms.model, base, folds, by=by)
    if poses.temperature is not None:
        # what the base terms alone leave may be ten times as much, as under gravity
        open_terms = open_terms.with_thermal(poses, trials.scatter((*base, *open_terms.kinds)))
    chosen, rows = base, [trials.start()]
    left: dict[str, TermComparison] = {}

    def grow(options: list[str], extra: float) -> list[str]:
        """Add the best supported option repeatedly; returns the remaining ones."""
        nonlocal chosen
        while options:
            tried = {o: trials.compare(chosen, o, extra) for o in options}
            left.update(tried)
            supported = [o for o in options if tried[o].taken]
            if not supported:
                break
            best = min(supported, key=lambda o: trials.mean((*chosen, o)))
            rows.append(left.pop(best))
            chosen = (*chosen, best)
            options = [o for o in options if o != best]
        return options

    remaining = grow([kind for kind in open_terms.kinds if kind not in FINER], 0.0)
    finer = [kind for kind in open_terms.kinds if FINER.get(kind) in chosen]
    remaining += grow(finer, 0.0) if finer else []
    if _INSTRUMENT in chosen and _LINKS in open_terms.kinds and _LINKS not in chosen:
        plain = tuple(term for term in chosen if term not in THERMAL)
        beside = tuple(
            term for term in chosen if term in THERMAL and term not in (_INSTRUMENT, FINER[_LINKS])
        )
        options = [(*plain, FINER[_LINKS], _LINKS), (*plain, *beside, FINER[_LINKS], _LINKS)]
        tried = [trials.compare_sets(chosen, terms, _LINKS) for terms in options]
        row = next((one for one in tried if one.taken), tried[-1])
        if row.taken:
            remaining = [term for term in remaining if term != _LINKS]
            reason = f"the arm's own links explain the same: {row.reason}"
            rows = [replace(r, taken=False, reason=reason) if r.term == _INSTRUMENT else r for r in rows]
            rows.append(row)
            left.pop(_LINKS, None)
            chosen = row.terms
    joints = [term for kind in remaining for term in open_terms.single.get(kind, ())]
    if joints:
        grow(joints, 2 * np.log(len(joints)))
        grow([kind for kind in remaining if kind not in open_terms.single], 0.0)
    excluded = [not_tried(term, chosen, reason) for term, reason in open_terms.excluded]
    kept = open_terms.model if "backlash" in chosen else model
    chosen = tuple(dict.fromkeys([*chosen, *assumed]))
    return TermSelection(chosen, kept, (*rows, *left.values(), *excluded), by, "")


def _too_few(poses: PoseSet, distinct: int, assumed: tuple[str, ...]) -> str:
    if distinct < LEAST_POSES:
        few, more = f"{distinct} different poses", f"{LEAST_POSES - distinct} more"
    else:
        numbers = coordinates(poses)
        few = f"{numbers} coordinates"
        more = f"{int(np.ceil((LEAST_COORDINATES - numbers) * len(poses) / numbers))} more poses"
    few = f"{few} are too few for cross-validation"
    if not assumed:
        return (
            f"terms beyond kinematics were not tried: {few}; measure {more}, so that compliance under gravity, backlash and "
            "transmission errors can be considered"
        )
    return (
        f"{few}, so terms were not chosen: compliance under gravity of every joint is estimated as likely as its prior and the points make "
        f"it; measure {more}, so that backlash and transmission errors can be considered too"
    )
