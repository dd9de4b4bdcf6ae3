"""At which temperatures the robots of a fleet were calibrated."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.calibration.comparison import temperature_of
from flexcal.jobs.fleet_prior.member import Member
from flexcal.model.robot import EXPANSION

_APART = 2.0
"""Largest difference between temperatures, K, that is not spoken of: 0.05 mm/m of aluminium."""
_STEEL, _ALUMINIUM = 0.012, 0.023
"""Expansion, mm/m/K."""


def temperature_remark(members: Sequence[Member]) -> list[str]:
    """A sentence where robots were calibrated at different temperatures, or at known and unknown ones; none where no temperature is known.

    The lengths of a calibration are those at its own temperature: with the thermal term at the reference of that, without it in the middle
    of what was measured.
    """
    known = {
        member.name: value for member in members if (value := temperature_of(member.estimate)) is not None
    }
    if not known:
        return []
    low, high = min(known.values()), max(known.values())
    without = [member.name for member in members if member.name not in known]
    said = []
    if high - low > _APART:
        coldest, warmest = min(known, key=known.__getitem__), max(known, key=known.__getitem__)
        grown = sorted({round(1e3 * abs(c), 4) for m in members if (c := _coefficient(m)) is not None})
        by = (
            f"by the expansion fitted to them ({' to '.join(f'{c:.3g}' for c in dict.fromkeys((grown[0], grown[-1])))} mm/m/K)"
            if grown
            else f"as steel or aluminium do ({_STEEL} to {_ALUMINIUM} mm/m/K)"
        )
        size = [(high - low) * c for c in ((grown[0], grown[-1]) if grown else (_STEEL, _ALUMINIUM))]
        span = " to ".join(f"{s:.2g}" for s in dict.fromkeys(size))
        said.append(
            f"the robots were calibrated at {low:.3g} ({coldest}) to {high:.3g} °C ({warmest}), and their lengths are pooled as they were "
            f"then: {by} they differ by up to {span} mm/m for that alone, which counts as differences between robots; calibrate them at "
            "one temperature"
        )
    if without:
        said.append(
            f"the temperature of {', '.join(without)} is not known, and their lengths are pooled as if it were that of the others "
            f"({low:.3g} to {high:.3g} °C)"
        )
    return said


def _coefficient(member: Member) -> float | None:
    """Expansion, 1/K, that was fitted to a robot; None without."""
    if EXPANSION not in member.estimate.parameters or member.estimate.std(EXPANSION) is None:
        return None
    return float(member.estimate.values[EXPANSION])
