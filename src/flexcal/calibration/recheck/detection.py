"""Shifts of single joints that a visit finds, predicted from its poses and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.recheck.global_test import FALSE_ALARM, VISIT_ALARM, GlobalTest

FOUND = 0.95
"""Probability with which a shift counts as found."""
_DRAWS = 4000


@dataclass(frozen=True)
class DetectionLimit:
    """What a visit finds of a shift of one joint.

    Attributes
    ----------
    subject, unit : str
        The joint, and the unit of its position.
    std : float
        Standard deviation of the shift, were it known to be of this joint: the Cramér-Rao bound of the visit, inf where it is not seen.
    power : float
        Probability that a shift of the given size is found.
    found : float
        Shift that is found with a probability of 95 %, inf where none is.
    bound : float
        The same of the best test for this joint alone, which no test can surpass (Neyman and Pearson 1933).
    """

    subject: str
    unit: str
    std: float
    power: float
    found: float
    bound: float


def detection_limits(test: GlobalTest, shift: float) -> tuple[DetectionLimit, ...]:
    """Power of a visit's test for a `shift`, rad (of sliding joints m), of every joint, and the shifts found in 95 % of visits."""
    unseen = [
        DetectionLimit(c.subject, c.units[0], np.inf, VISIT_ALARM, np.inf, np.inf)
        for c in test.unseen
        if c.kind == "joint_shifted"
    ]
    seen = []
    for item in test.seen:
        if item.change.kind != "joint_shifted":
            continue
        length = float(np.linalg.norm(item.columns))
        seen.append(
            DetectionLimit(
                item.change.subject,
                item.change.units[0],
                1 / length,
                power(test, item.columns[:, 0] * shift),
                least_found(test) / length,
                _bound(test.freedom) / length,
            )
        )
    order = [joint.name for joint in test.errors.model.motor_joints]
    return tuple(sorted([*seen, *unseen], key=lambda limit: order.index(limit.subject)))


def power(test: GlobalTest, effect: np.ndarray) -> float:
    """Probability that the test rejects errors of mean `effect` (m,) in whitened coordinates."""
    return float(np.mean(test.least_of(_DRAWS, effect, seed=1) <= test.level))


def least_found(test: GlobalTest) -> float:
    """Length of an effect of one parameter in whitened coordinates that its own part of the test finds with 95 %."""
    return _noncentrality(test.level, test.freedom)


def _bound(freedom: float) -> float:
    return _noncentrality(FALSE_ALARM, freedom)


def _noncentrality(level: float, freedom: float) -> float:
    """Root of the noncentrality at which a test of one degree of freedom at a `level` has a power of 95 %."""
    from scipy.optimize import brentq
    from scipy.special import chdtri, chndtr, fdtri, ncfdtr

    if np.isfinite(freedom):
        critical = float(fdtri(1, freedom, 1 - level))

        def missed(distance: float) -> float:
            return np.nan_to_num(
                ncfdtr(1, freedom, distance**2, critical)
            )  # nan where it is too small to be computed

        return float(brentq(lambda distance: missed(distance) - (1 - FOUND), 0.5, 60.0))  # pyright: ignore
    critical = float(chdtri(1, level))
    return float(brentq(lambda d: chndtr(critical, 1, d * d) - (1 - FOUND), 0.5, 60.0))  # pyright: ignore
