"""Which terms beyond the kinematic ones the data support, by cross-validation that does not leak."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.folds import order_folds, workspace_folds
from flexcal.calibration.geometric_calibration import Calibration, calibrate
from flexcal.calibration.prediction import predict
from flexcal.calibration.terms import geometric_parameters, tolerances
from flexcal.data import PoseSet
from flexcal.model import RobotModel, gravity_torque
from flexcal.units import MILLIMETRE

FOLDS = 8
_CLEAR = 0.2
"""Share of its largest gravity torque that a joint must carry on both sides for a backlash to be considered."""


@dataclass(frozen=True, eq=False)
class TermSelection:
    """`terms` that cross-validation supports, and the `table` of (terms, error over order folds, over workspace folds), metres."""

    terms: tuple[str, ...]
    model: RobotModel
    table: tuple[tuple[tuple[str, ...], float, float], ...]

    def __str__(self) -> str:
        rows = [
            f"{' + '.join(t)}: {a / MILLIMETRE:.4f} mm in order, {b / MILLIMETRE:.4f} mm in workspace"
            for t, a, b in self.table
        ]
        return "; ".join(rows)


def select_terms(model: RobotModel, poses: PoseSet) -> TermSelection:
    """Forward selection of gravity compliance, backlash and transmission harmonics on top of the rigid fit.

    A term is added where it lowers the mean error on poses left out, by more than one standard error of the paired difference, both for
    folds contiguous in measuring order and in the workspace. Fits of the folds are linear, about the rigid fit on all poses. Backlash
    is considered at the declared joints, or, without any, at the joints that gravity loads from both sides. Needs ten poses a fold.
    """
    elastic = bool(model.elastic)
    base = ["kinematic"] + (["backlash"] if model.backlash_joints else [])
    if len(poses.q) < 10 * FOLDS:
        return TermSelection(tuple(base), model, ())
    wider = model if model.backlash_joints else _with_backlash(model, poses)
    options = [] if elastic else ["gravity_compliance"]
    options += ["backlash"] if wider.backlash_joints and not model.backlash_joints else []
    options += [f"transmission_{order}" for order in model.harmonics]
    rigid = calibrate(model, poses, terms=base, elastic=elastic)
    folds = [order_folds(len(poses.q), FOLDS), workspace_folds(poses.position, FOLDS)]
    columns = _columns(wider, rigid, base + options)
    chosen, scores = tuple(base), _left_out(columns, rigid.residuals, base, folds)
    table = [(chosen, float(scores[0].mean()), float(scores[1].mean()))]
    while options:
        trials = {o: _left_out(columns, rigid.residuals, [*chosen, o], folds) for o in options}
        best = min(trials, key=lambda o: sum(float(s.mean()) for s in trials[o]))
        table.append(((*chosen, best), float(trials[best][0].mean()), float(trials[best][1].mean())))
        if not all(_better(old, new, f) for old, new, f in zip(scores, trials[best], folds, strict=True)):
            break
        chosen, scores = (*chosen, best), trials[best]
        options.remove(best)
    return TermSelection(chosen, wider if "backlash" in chosen else model, tuple(table))


def _with_backlash(model: RobotModel, poses: PoseSet) -> RobotModel:
    torque = gravity_torque(model, poses.q)
    clear = _CLEAR * np.abs(torque).max(axis=0)
    both = (torque.max(axis=0) > clear) & (torque.min(axis=0) < -clear) & (clear > 0.1)
    names = tuple(joint.name for joint, possible in zip(model.joints, both, strict=True) if possible)
    return replace(
        model, config=replace(model.config, geometry=replace(model.config.geometry, backlash=names))
    )


def _columns(model: RobotModel, rigid: Calibration, terms: Sequence[str]) -> dict[str, np.ndarray]:
    """Scaled Jacobian columns (N, 3, k) of each term at the rigid fit."""
    at = replace(rigid.model, config=model.config)
    prediction = predict(at, rigid.poses, elastic=bool(model.elastic), jacobians=True)
    result = {}
    for term in terms:
        parameters = geometric_parameters(at, rigid.poses, [term])
        names = [n for n in parameters.names if n in rigid.identifiability.kept_names or term != "kinematic"]
        result[term] = prediction.jacobian(names) * tolerances(parameters.subset(names))
    return result


def _left_out(
    columns: dict[str, np.ndarray], residuals: np.ndarray, terms: Sequence[str], folds: list[np.ndarray]
) -> list[np.ndarray]:
    """Distance (N,) between left-out points and their prediction, for each kind of fold."""
    stacked = np.concatenate([columns[term] for term in terms], axis=2)
    scores = []
    for fold in folds:
        distance = np.empty(len(residuals))
        for k in np.unique(fold):
            out = fold == k
            inside = stacked[~out].reshape(-1, stacked.shape[2])
            solution = np.linalg.lstsq(inside, residuals[~out].ravel(), rcond=1e-9)[0]
            distance[out] = np.linalg.norm(residuals[out] - stacked[out] @ solution, axis=1)
        scores.append(distance)
    return scores


def _better(old: np.ndarray, new: np.ndarray, fold: np.ndarray) -> bool:
    """Whether the mean error falls by more than one standard error, folds being the independent units."""
    gains = np.array([(old - new)[fold == k].mean() for k in np.unique(fold)])
    return bool(gains.mean() > gains.std(ddof=1) / np.sqrt(len(gains)))
