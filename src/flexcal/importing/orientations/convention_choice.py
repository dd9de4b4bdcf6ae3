"""Choice of the convention by which measured orientations are those of the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.importing.orientations.convention_fit import NominalPoses, OrientationFit, fit_orientations
from flexcal.importing.orientations.conventions import Convention
from flexcal.units import DEGREE

_FITS = 3.0 * DEGREE
"""Largest rms angle between a robot and its nominal kinematics, where points confirm these."""
_EXPLAINED = 0.25
"""Largest share of the variation of the orientations that a convention may leave unexplained."""
_CLEARLY = 2.0
"""Ratio of misfits by which the best convention must be better than the next."""
_SAME = 0.01 * DEGREE
"""Readings that differ by less, beside a constant rotation of the target, are one: no instrument tells them apart."""
_MOST_ROWS = 60


@dataclass(frozen=True, eq=False)
class ConventionChoice:
    """Conventions in the order of their misfit.

    best: the first of them; following: the next that reads other orientations, None without any; rivals: those that fit about as well;
    spread (rad): variation of the robot's orientations.
    """

    best: OrientationFit
    following: OrientationFit | None
    rivals: tuple[OrientationFit, ...]
    spread: float

    @property
    def fits(self) -> bool:
        """Whether the best convention makes the orientations those of this robot."""
        return self.best.rms <= min(_FITS, _EXPLAINED * self.spread)

    @property
    def steady(self) -> bool:
        """Whether the best convention would do, if the orientations varied more."""
        return _EXPLAINED * self.spread < self.best.rms <= _FITS

    @property
    def certain(self) -> bool:
        """Whether it is the only one that does."""
        return self.fits and not self.rivals


def choose_convention(
    nominal: NominalPoses, conventions: Sequence[Convention], values: np.ndarray
) -> ConventionChoice:
    """Compare `conventions` of `values` (N, 3) or (N, 4) by their fit to the nominal robot, on at most sixty rows."""
    some = np.unique(np.linspace(0, len(values) - 1, min(len(values), _MOST_ROWS)).astype(int))
    poses = nominal.rows(some)
    fits = [fit_orientations(poses, convention, values[some]) for convention in conventions]
    fits.sort(key=lambda fit: fit.misfit)
    best = fits[0]
    others = [fit for fit in fits[1:] if not fit.same_as(best, _SAME)]
    rivals = tuple(fit for fit in others if fit.misfit < _CLEARLY * best.misfit)
    return ConventionChoice(best, others[0] if others else None, rivals, poses.spread())
