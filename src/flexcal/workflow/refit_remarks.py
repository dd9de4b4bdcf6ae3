"""What placing the instrument or the measured point again does to a verification, for people and for results.json."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from flexcal.calibration import Refit, Refitted, Verification, refitted
from flexcal.data import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model import RobotModel
from flexcal.units import MILLIMETRE

_WORTH = 0.5
"""Placing something again is proposed where it leaves less than this of the root mean square error."""
_TENTH = 0.1
_MUCH = 1e-4
"""m: a mean error below this is not worth a proposal."""
_CHANGED = {
    ("station",): (
        "after placing the station again",
        "the instrument, or the robot's base, was moved since the calibration",
    ),
    ("point",): (
        "after finding the point again",
        "the reflector is not where it was at the calibration, or is another one",
    ),
    ("station", "point"): (
        "after placing the station and finding the point again",
        "both instrument and reflector are not where they were at the calibration",
    ),
}


def proposed_refit(model: RobotModel, poses: PoseSet, found: Verification) -> Refitted | None:
    """What would leave less than half of the errors if placed again, by leave-one-out; None where nothing does.

    What is left has to be about what is predicted, or a tenth: a model that is wrong far from its calibration poses also
    looks somewhat as if the instrument had been moved.
    """
    rms = _rms(found)
    if found.all.mean < _MUCH:
        return None
    best: Refitted | None = None
    tried: Sequence[tuple[Refit, ...]] = (("station",), ("point",), ("station", "point"))
    for what in tried:
        try:
            again = refitted(model, poses, what)
        except FlexcalError:
            continue
        # two things again only where they leave half of what one leaves
        least = rms if best is None else _rms(best.result)
        if _rms(again.result) < (_WORTH if best is None or len(what) > len(best.what) else 1.0) * least:
            best = again
    return best if best is not None and _explains(best, rms) else None


def _explains(best: Refitted, rms: float) -> bool:
    left = _rms(best.result)
    predicted = float(np.sqrt(np.mean(best.result.expected_rms**2)))
    return left < _TENTH * rms or (best.covariance.independent is not None and left < 2 * predicted)


def refit_remarks(
    found: Verification, poses: PoseSet, refit: Refitted | None, better: Refitted | None
) -> tuple[str, ...]:
    """One sentence on what was placed again, or should be."""
    if refit is not None:
        placed = {"station": "station placed", "point": "point found"}
        return (
            f"{' and '.join(placed[name] for name in refit.what)} again from these poses, geometry as calibrated: {refit.parameters} of "
            f"{3 * len(poses)} coordinates went into that, those of {_poses(refit)} poses, and every error is of a pose left out of it",
        )
    if better is None:
        return ()
    after, cause = _CHANGED[better.what]
    return (
        f"{found.all.mean / MILLIMETRE:.3g} mm on average; {after} {better.result.all.mean / MILLIMETRE:.2g}: {cause}. "
        f"--refit {' '.join(better.what)} verifies the geometry alone, at the price of {_poses(better)} poses",
    )


def refit_document(refit: Refitted | None, poses: int) -> dict[str, Any] | None:
    """For results.json."""
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


def _poses(refit: Refitted) -> int:
    return -(-refit.parameters // 3)


def _rms(found: Verification) -> float:
    return float(np.sqrt((found.errors**2).sum(axis=1).mean()))
