"""Selection of measurements by exchange, for every optimality criterion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.design.optimality.criteria import Criterion, DOptimal, SpectralCriterion, TraceOptimal
from flexcal.design.optimality.eigenvalue_exchange import spectral_exchange
from flexcal.design.optimality.rank_updates import Selection, check_selection, rank_exchange
from flexcal.errors import FlexcalError
from flexcal.estimation import Sensitivity
from flexcal.progress import Progress, silent


def exchange(
    sensitivity: Sensitivity,
    count: int,
    criterion: Criterion,
    *,
    start: Sequence[int] | np.ndarray | None = None,
    passes: int = 20,
    progress: Progress = silent,
) -> Selection:
    """Choose the `count` candidates of best merit by exchange; every candidate serves once.

    Without `start` (at most `count` indices) the set grows greedily. Then every member in turn is taken out and the best candidate put
    in, until a pass changes nothing or `passes` are done. The result is a local optimum. Raises `FlexcalError` when `count` exceeds
    the candidates or cannot determine the parameters.
    """
    if isinstance(criterion, DOptimal | TraceOptimal):
        return rank_exchange(sensitivity, count, criterion, start=start, passes=passes, progress=progress)
    check_selection(sensitivity, count, criterion, start)
    if isinstance(criterion, SpectralCriterion):
        return spectral_exchange(sensitivity, count, criterion, start=start, passes=passes, progress=progress)
    raise FlexcalError(
        "E-DESIGN-015", f"exchange knows D, trace and spectral criteria, not {criterion.name}."
    )
