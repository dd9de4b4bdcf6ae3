"""What a calibration has from other robots of the model, and whether they fit this one."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.calibration.diagnostics import EnoughPoses, FleetConflict
from flexcal.calibration.fit import GeometricFit
from flexcal.report.layout import listed

_LEARNT = 0.8
"""Standard deviation, relative to that of the prior, from which the measurements say little of a parameter."""
_LISTED = 8


def fleet_document(fit: GeometricFit, conflict: FleetConflict | None) -> dict[str, Any] | None:
    """Block `fleet` of results.json; None for a calibration without such a prior.

    `from_fleet` are the parameters of which these measurements tell so little that their standard deviation is at least 0.8 times the
    prior's, and which the other robots tell; `released` those in which the robot deviates alone; `enough` is how many poses with the prior
    reach what many do without it.
    """
    fleet = fit.fleet
    if fleet is None or conflict is None:
        return None
    enough = None if conflict.contradicted else EnoughPoses.of(fit)
    before = np.sqrt(np.diag(fleet.covariance))
    std = [fit.estimate.std(name) for name in fleet.names]
    known = [
        name
        for name, s, b in zip(fleet.names, std, before, strict=True)
        if s is not None and s >= _LEARNT * b
    ]
    return {
        "file": fleet.source,
        "robots": list(fleet.robots),
        "parameters": len(fleet.names),
        "from_fleet": known,
        "released": dict(fleet.released),
        "conflict": conflict.document(),
        "enough": None if enough is None else enough.document(),
    }


def contradicts(block: dict[str, Any] | None) -> bool:
    """Whether the block `fleet` of results.json tells of a robot that the prior does not fit."""
    return block is not None and bool(block["conflict"]["contradicted"])


def fleet_remarks(block: dict[str, Any] | None) -> list[str]:
    """Sentences on the block `fleet` of results.json."""
    if block is None:
        return []
    robots, known = block["robots"], block["from_fleet"]
    named = listed(known, _LISTED)
    sentence = f"calibrated with a prior of {len(robots)} other robots of the model ({block['file']})"
    sentence += (
        f": {len(known)} of its {block['parameters']} parameters are from the fleet, not from these measurements: {named}"
        if known
        else f": the measurements improve all its {block['parameters']} parameters"
    )
    if block["enough"] is not None:
        sentence += f"; {_enough_sentence(block['enough'])}"
    remarks = [sentence]
    if block["released"]:
        remarks.append(_released_sentence(block["released"]))
    return [*remarks, *([conflict_sentence(block)] if contradicts(block) else [])]


def _released_sentence(released: dict[str, float]) -> str:
    most = listed([f"{name} ({shift:+.1f} σ)" for name, shift in released.items()], _LISTED)
    one = len(released) == 1
    loaded = " or with a load that is not declared" if any("compliance" in name for name in released) else ""
    return (
        f"the robot deviates from the others beyond chance (p < 0.01) in {'' if one else 'one or more of '}{most}, or in what has the same "
        f"effect, as after a repair{loaded}: {'it was' if one else 'these were'} estimated "
        "without the prior, and what the others tell of the rest fits"
    )


def _enough_sentence(enough: dict[str, Any]) -> str:
    reached = f"of {enough['alone']} without it ({enough['rms_mm']:.2g} mm RMS predicted, at random poses in these joint ranges)"
    if enough["poses"] < enough["alone"]:
        return f"about {enough['poses']} poses with this prior reach the accuracy {reached}"
    return f"robots differ so much that no fewer poses with this prior reach the accuracy {reached}"


def conflict_sentence(block: dict[str, Any]) -> str:
    """What is said of a robot that the prior does not fit."""
    conflict = block["conflict"]
    most = [f"{name} ({shift:+.1f} σ)" for name, shift in conflict["shifts"].items()]
    others = conflict["deviating"] - len(most)
    if conflict["alone"]:
        more = f" or one of {others} more" if others > 0 else ""
        deviation = f"it deviates from the other robots as if {' or '.join(most)}{more} alone were off"
    else:
        more = f" and {others} more by over 3 σ" if others > 0 else ""
        where = f", most in {', '.join(most)}{more}" if most else ""
        deviation = f"it deviates from the other robots {conflict['size']:.2g} times as much as they differ among each other{where}"
    return (
        f"the prior does not fit this robot (p {_probability(conflict['probability'])}): {deviation}; is it of another model or batch, or "
        "was it repaired? Calibrate it without --prior"
    )


def _probability(value: float) -> str:
    return f"= {value:.2g}" if value > 0.003 else "< 0.003"
