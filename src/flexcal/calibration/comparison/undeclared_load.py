"""Whether a load that was not declared explains a change of the geometry as well as parameters do."""

from __future__ import annotations

import numpy as np

from flexcal.calibration.comparison.explanations import ALIKE, LEVEL, chance_of

_SEEN = 1e-2
"""Effect of a joint that yields, relative to the largest, below which the load has no torque about it."""


def load_explains(change: np.ndarray, sag: np.ndarray, chosen: np.ndarray, freedom: float) -> bool:
    """Whether a whitened `change` (m,) is that of an arm of which the joints yield to a load, by columns `sag` (m, n), about as well as it
    is that of parameters with the columns `chosen` (m, c).

    The mass of the load and the compliance of each joint are not known, but every joint yields in the direction of its torque, or, where a
    load was taken off, against it: the coefficients of the columns are of one sign (non-negative least squares, Lawson and Hanson 1974).
    `freedom` are the degrees of freedom of the noise. The two are compared by Akaike's criterion.
    """
    from scipy.optimize import nnls

    sizes = np.linalg.norm(sag, axis=0)
    sag = sag[:, sizes > _SEEN * sizes.max(initial=0.0)]
    if not sag.size:
        return False
    sag = sag / np.linalg.norm(sag, axis=0)
    coefficients, rest = min((nnls(side * sag, change) for side in (1, -1)), key=lambda fit: fit[1])
    used = int(np.count_nonzero(coefficients))
    of_load = float(rest) ** 2
    others = chosen / np.linalg.norm(chosen, axis=0)
    left = change - others @ np.linalg.lstsq(others, change, rcond=1e-6)[0]
    return (
        chance_of(of_load, len(change) - used, freedom) > LEVEL
        and of_load + 2 * used < left @ left + 2 * chosen.shape[1] + ALIKE
    )
