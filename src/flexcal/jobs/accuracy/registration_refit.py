"""Refit of the instrument's placement or the measured point in a verification: proposal, remarks and block of results.json."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from flexcal.calibration.verification import PredictionErrors, Refit, RefittedVerification, verify_refitted
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

_WORTH = 0.5
"""Fraction of the root mean square error below which a refit must bring it to be proposed."""
_TENTH = 0.1
_CHANCE = 1e-3
"""Probability of a placement as far from the calibrated one, below which something was moved."""
_MUCH = 1e-4
"""Mean error, m, below which no refit is proposed."""
_CHANGED = {
    ("station",): (
        "after a refit of the station",
        "the instrument, or the robot's base, was moved since the calibration",
    ),
    ("point",): (
        "after a refit of the point",
        "the reflector was moved or replaced since the calibration",
    ),
    ("station", "point"): (
        "after a refit of station and point",
        "both instrument and reflector were moved since the calibration",
    ),
}


def proposed_refit(
    model: RobotModel, poses: PoseSet, verification: PredictionErrors
) -> RefittedVerification | None:
    """The refit that reduces the leave-one-out errors to less than half; None where there is none.

    The remaining errors have to be about as large as predicted, or a tenth of those before, because a refit also reduces errors of a
    model that is wrong far from its calibration poses; and the placement has to be farther from the calibrated one than the calibration's
    own uncertainty of it explains.
    """
    rms = _rms(verification)
    if verification.all.mean < _MUCH:
        return None
    best: RefittedVerification | None = None
    tried: Sequence[tuple[Refit, ...]] = (("station",), ("point",), ("station", "point"))
    for what in tried:
        try:
            again = verify_refitted(model, poses, what)
        except FlexcalError:
            continue
        # both only where they halve the error of the better single refit
        least = rms if best is None else _rms(best.result)
        if _rms(again.result) < (_WORTH if best is None or len(what) > len(best.what) else 1.0) * least:
            best = again
    return best if best is not None and best.probability < _CHANCE and _explains(best, rms) else None


def _explains(best: RefittedVerification, rms: float) -> bool:
    left = _rms(best.result)
    predicted = float(np.sqrt(np.mean(best.result.expected_rms**2)))
    return left < _TENTH * rms or (best.covariance.independent is not None and left < 2 * predicted)


def refit_remarks(
    verification: PredictionErrors,
    poses: PoseSet,
    refit: RefittedVerification | None,
    better: RefittedVerification | None,
) -> tuple[str, ...]:
    """One sentence on a refit that was made or is proposed."""
    if refit is not None:
        return (
            f"{' and '.join(refit.what)} refitted to these poses, geometry as calibrated: {refit.parameters} parameters of "
            f"{3 * len(poses)} coordinates, as many as {_poses(refit)} poses have; errors are leave-one-out errors",
        )
    if better is None:
        return ()
    after, cause = _CHANGED[better.what]
    return (
        f"mean error {verification.all.mean / MILLIMETRE:.3g} mm; {after} {better.result.all.mean / MILLIMETRE:.2g} mm: {cause}. "
        f"--refit {' '.join(better.what)} verifies the geometry alone, and costs {_poses(better)} poses",
    )


def refit_document(refit: RefittedVerification | None, poses: int) -> dict[str, Any] | None:
    """Block of results.json on the refit."""
    if refit is None:
        return None
    return {
        "what": list(refit.what),
        "parameters": refit.parameters,
        "coordinates": 3 * poses,
        "costs_poses": _poses(refit),
        "statistics": "leave_one_out",
        **refit.result.all.in_millimetres(),
    }


def _poses(refit: RefittedVerification) -> int:
    return -(-refit.parameters // 3)


def _rms(verification: PredictionErrors) -> float:
    return float(np.sqrt((verification.errors**2).sum(axis=1).mean()))
