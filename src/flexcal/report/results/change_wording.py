"""Change of a robot's geometry in words."""

from __future__ import annotations

import math

from flexcal.calibration.comparison import GROWTH, Explanation, GeometryChange
from flexcal.model.robot import unit_of
from flexcal.report.results.chance_wording import chance_in_words
from flexcal.units import MILLIMETRE

_ALTERNATIVES = 4
"""Number of parameters that are named as possible in place of another."""


def change_sentence(change: GeometryChange) -> str:
    """Verdict in one sentence: no change beyond chance, or what changed by how much."""
    chance = chance_in_words(change.probability)
    if not change.changed:
        return f"no change beyond chance ({chance})"
    if not change.explanations:
        return f"changed ({chance}), by no single parameter"
    return f"changed ({chance}): " + "; ".join(explanation_in_words(item) for item in change.explanations)


def explanation_in_words(item: Explanation) -> str:
    """A parameter or point with its change and standard deviation in mm, mrad or SI units, and what may have changed in its place."""
    name = next(iter(item.names))
    if item.subject == GROWTH:
        told = f"all lengths by {amount(1e6 * sum(item.change), 1e6 * sum(item.std), 'µm/m')}"
    elif item.subject != name:
        size = math.hypot(*item.change)
        # along the change itself
        std = (
            math.sqrt(sum((c * s) ** 2 for c, s in zip(item.change, item.std, strict=True))) / size
            if size
            else 0.0
        )
        told = f"the place of {item.subject} on the tool by {amount(size, std, 'm', signed=False)}"
    else:
        told = f"{item.subject} by {amount(sum(item.change), sum(item.std), unit_of(name))}"
    if not item.alternatives:
        return told
    others = ["all lengths" if name == GROWTH else name for name in item.alternatives[:_ALTERNATIVES]]
    if len(item.alternatives) > _ALTERNATIVES:
        others.append(f"{len(item.alternatives) - _ALTERNATIVES} others")
    return f"{told} (or {', '.join(others)}, which cannot be told from it)"


def amount(value: float, std: float, unit: str, *, signed: bool = True) -> str:
    """Value with its standard deviation, to two digits of this, in mm or mrad."""
    factor, told = {"m": (1 / MILLIMETRE, "mm"), "rad": (1e3, "mrad")}.get(unit, (1.0, unit))
    value, std = factor * value, factor * std
    if not std > 0 or not 1e-4 < std < 1e4:
        return f"{value:{'+' if signed else ''}.3g} ± {std:.2g} {told}".replace("-", "−")
    digits = max(0, 1 - math.floor(math.log10(std)))
    return f"{value:{'+' if signed else ''}.{digits}f} ± {std:.{digits}f} {told}".replace("-", "−")
