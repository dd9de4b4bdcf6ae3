"""Parameters in which a robot deviates from others of its model, as after a repair, estimated without their prior."""

from __future__ import annotations

from collections.abc import Callable

from flexcal.calibration.diagnostics import FleetConflict
from flexcal.calibration.fit import FleetPrior
from flexcal.jobs.calibration.fits import Fits

_ROUNDS = 3
"""Largest number of deviations that are released one after the other."""


def without_deviating(
    prior: FleetPrior, conflict: FleetConflict, fit: Callable[[FleetPrior], Fits]
) -> tuple[FleetPrior, Fits, FleetConflict] | None:
    """The prior without the few parameters in which the robot deviates from the others, the fits with it, and the test of the rest.

    None where no single parameter explains the `conflict`, and where the rest does not fit either.
    """
    deviations: dict[str, float] = {}
    for _ in range(_ROUNDS):
        if not conflict.single:
            return None
        deviations |= conflict.single
        own = prior.without(deviations)
        fits = fit(own)
        after = FleetConflict.of(fits.selected)
        assert after is not None
        if not after.contradicted:
            return own, fits, after
        conflict = after
    return None
