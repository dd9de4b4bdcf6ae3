"""Remarks on an identified payload: identifiability, consistency, and estimates made with another payload."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from flexcal.dynamics.payload import BODY, PayloadFit
from flexcal.estimation import Estimate
from flexcal.files.formats import Block
from flexcal.model.parts import Payload
from flexcal.model.robot import RobotModel
from flexcal.report.checks import BODILESS, UNLIKE


def payload_remarks(fit: PayloadFit, declared: RobotModel, blocks: Mapping[Block, Estimate]) -> Iterator[str]:
    """Remarks on an identified payload, one sentence each."""
    estimate = fit.estimate
    hidden = [
        name for name, seen in zip(estimate.parameters.names, estimate.identifiable, strict=True) if not seen
    ]
    if hidden:
        stay_at = "as robot.yaml declares them" if declared.payload is not None else "at zero"
        yield f"these recordings do not determine {', '.join(hidden)}, which stay {stay_at}"
    if fit.rise > BODILESS:
        yield (
            f"the payload is not physically consistent: the nearest consistent one raises the sum of squares by {fit.rise:.3g}; check "
            f"the drive "
            "gains, that the robot's own dynamics are of this robot, and the frame"
        )
    if fit.error > UNLIKE * fit.own_error:
        yield (
            f"the robot's own dynamics do not fit these recordings: the relative torque error is {100 * fit.error:.2g} %, and "
            f"{100 * fit.own_error:.2g} % with separate fits of every joint; identify them again, or give --free recordings"
        )
    low, high = _certain_mass(estimate)
    if declared.payload is not None and not low <= declared.payload.mass <= high:
        yield f"robot.yaml declares {declared.payload.mass:g} kg; the identified payload is used from now on"
    for name, mass in other_payloads(estimate, blocks).items():
        yield (
            f"the block '{name}' was identified with a payload of {mass:.4g} kg; if the robot held this payload then, identify it again"
        )


def other_payloads(estimate: Estimate, blocks: Mapping[Block, Estimate]) -> dict[str, float]:
    """Mass (kg) of the payload of those `blocks` that were estimated with another one than `estimate`."""
    low, high = _certain_mass(estimate)
    masses = {name: block.values.get("payload.mass", low) for name, block in blocks.items()}
    return {name: mass for name, mass in masses.items() if not low <= mass <= high}


def declared_payload(payload: Payload) -> dict[str, float]:
    """Payload values declared in robot.yaml, by the names of the identified ones."""
    values = np.concatenate([[payload.mass], payload.com, payload.moments])
    return {f"payload.{key}": float(value) for key, value in zip(BODY, values, strict=True)}


def _certain_mass(estimate: Estimate) -> tuple[float, float]:
    return estimate.interval("payload.mass") or (0.0, 0.0)
