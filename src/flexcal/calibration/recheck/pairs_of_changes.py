"""Two changes of a robot that together explain the errors of a visit."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from flexcal.calibration.recheck.change_effects import PossibleChange
from flexcal.calibration.recheck.global_test import FALSE_ALARM, GlobalTest, misfit_of

Pair = tuple[PossibleChange, PossibleChange]


def two_changes(test: GlobalTest) -> Pair | None:
    """The two changes, neither of them of the instrument, that leave least, where chance leaves as much; None where no two do."""
    values = test.whitening @ test.errors.errors
    robot = [item for item in test.seen if item.change.kind != "instrument_moved"]
    best: tuple[float, Pair] | None = None
    for one, other in combinations(robot, 2):
        misfit, rank = misfit_of(values, np.hstack([one.basis, other.basis]))
        freedom = test.size - rank
        chance = float(test.chance(misfit, freedom)) if freedom > 0 else 0.0
        if chance > FALSE_ALARM and (best is None or chance > best[0]):
            best = chance, (one.change, other.change)
    return None if best is None else best[1]
