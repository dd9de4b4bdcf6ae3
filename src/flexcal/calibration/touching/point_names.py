"""Checks of points of known coordinates against where they were touched: names exchanged, mirror images, other units."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np

from flexcal.calibration.kinds import rigid_motion
from flexcal.errors import FlexcalError

_ALL_ORDERS = 6
"""Largest number of points of which all permutations are tried; of more, exchanges of two."""
_BETTER = 5.0
"""Factor by which another order, or a mirror image, must fit better to be the explanation."""
_BY_HAND = 1e-3
"""Residual, m, that touching by hand explains without more."""
_SIZE = 0.1
"""Relative deviation of the size beyond which the units are wrong."""


@dataclass(frozen=True)
class OtherOrder:
    """Names (text) whose exchange fits best of all, and the residual (rms, m) with them exchanged."""

    names: str
    rms: float


def explain_points(
    names: np.ndarray, known: np.ndarray, tip: np.ndarray, expected: float
) -> OtherOrder | None:
    """The order of names that fits about as well as that which is given, if there is one.

    `names` (N,), `known` (N, 3) coordinates in the work object's frame and `tip` (N, 3) in the base frame, m; `expected` is the residual
    (rms, m) that the arm explains. Raises `FlexcalError` where another order, a mirror image or another unit explains the touches and
    the given points do not.
    """
    listed = sorted(set(names.tolist()))
    w = np.array([known[names == name][0] for name in listed])
    p = np.array([tip[names == name].mean(axis=0) for name in listed])
    _require_size(w, p)
    given = _rms(w, p)
    wrong = given > 3 * expected + _BY_HAND
    orders = _orders(len(listed))
    residuals = np.array([_rms(w[list(order)], p) for order in orders])
    best = int(np.argmin(residuals))
    other = OtherOrder(_exchanged(listed, orders[best]), float(residuals[best]))
    mirrored = _rms(w * [1, 1, -1], p)
    if wrong and min(other.rms, mirrored) < given / _BETTER:
        if mirrored < other.rms / 2:
            raise FlexcalError(
                "E-TOOL-021",
                f"the points fit as a mirror image ({mirrored * 1e3:.2g} mm rms instead of {given * 1e3:.2g} mm), so wx, wy, wz are not of "
                "a right-handed frame: change the sign of one of them, or exchange two.",
            )
        raise FlexcalError(
            "E-TOOL-022",
            f"points {other.names} look swapped: {other.rms * 1e3:.2g} mm rms that way, {given * 1e3:.2g} mm as they stand; correct the "
            "column point or their coordinates.",
        )
    return other if other.rms < 3 * max(given, expected) + _BY_HAND else None


def _orders(count: int) -> list[tuple[int, ...]]:
    """Orders of so many points other than the given one."""
    if count <= _ALL_ORDERS:
        return list(permutations(range(count)))[1:]
    found = []
    for i, j in combinations(range(count), 2):
        order = list(range(count))
        order[i], order[j] = j, i
        found.append(tuple(order))
    return found


def _exchanged(names: list[str], order: tuple[int, ...]) -> str:
    moved = [name for name, other in zip(names, order, strict=True) if name != names[other]]
    return ", ".join(moved[:-1]) + f" and {moved[-1]}"


def _rms(known: np.ndarray, tip: np.ndarray) -> float:
    rotation, origin = rigid_motion(known, tip)
    return float(np.sqrt(np.mean(np.sum((known @ rotation.T + origin - tip) ** 2, axis=1))))


def _require_size(known: np.ndarray, tip: np.ndarray) -> None:
    """Refuse coordinates in another unit, or of another work object."""
    size, touched = (float(np.sqrt(np.sum((x - x.mean(axis=0)) ** 2))) for x in (known, tip))
    ratio = size / touched
    if abs(ratio - 1) <= _SIZE:
        return
    unit = {1000.0: "mm", 39.37: "inch", 100.0: "cm"}
    for factor, name in unit.items():
        if abs(ratio / factor - 1) <= _SIZE:
            raise FlexcalError("E-TOOL-023", f"wx, wy, wz are in {name}; write them in m.")
    raise FlexcalError(
        "E-TOOL-024",
        f"the points wx, wy, wz lie {ratio:.3g} times as far from each other as they were touched; check coordinates and names.",
    )
