"""What a user should know of an identified payload beside the numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from flexcal.dynamics import PayloadFit
from flexcal.estimates_file import Block
from flexcal.estimation import Estimate
from flexcal.model import RobotModel

_BODILESS = 29.6
"""Sum of ten squared normal errors that one in a thousand exceeds."""
_UNLIKE = 3.0
"""Times what must be missed of the torques that is too much."""


def payload_remarks(fit: PayloadFit, declared: RobotModel, blocks: Mapping[Block, Estimate]) -> Iterator[str]:
    """One sentence each."""
    found = fit.estimate
    hidden = [name for name, seen in zip(found.parameters.names, found.identifiable, strict=True) if not seen]
    if hidden:
        held = "as robot.yaml declares them" if declared.payload is not None else "at zero"
        yield f"these recordings do not tell {', '.join(hidden)}, which stay {held}"
    if fit.rise > _BODILESS:
        yield (
            f"no body has what these torques ask for: the nearest one raises the sum of squares by {fit.rise:.3g}; check the drive "
            "gains, that the robot's own dynamics are of this robot, and the frame"
        )
    if fit.error > _UNLIKE * fit.own_error:
        yield (
            f"the robot's own dynamics do not fit these recordings: {100 * fit.error:.2g} % of the torques are missed, where another robot "
            f"of these links would miss {100 * fit.own_error:.2g} %; identify them again, or give --free recordings"
        )
    low, high = found.interval("payload.mass") or (0.0, 0.0)
    if declared.payload is not None and not low <= declared.payload.mass <= high:
        yield f"robot.yaml declares {declared.payload.mass:g} kg; what was identified counts from now on"
    for name, block in blocks.items():
        mass = block.values.get("payload.mass", low)
        if not low <= mass <= high:
            yield (
                f"the block '{name}' was found with a payload of {mass:.4g} kg; if the robot held this one then, make that block again"
            )
