"""File of an identification's estimate."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from flexcal.estimates_file import Block, write_estimates
from flexcal.estimation import Estimate

ESTIMATES = "estimates.yaml"


def store_block(
    source: Path, target: Path, others: Mapping[Block, Estimate], block: Block, estimate: Estimate
) -> None:
    """Write `estimate` as `block` of the file `target`; where that is not the robot's own `source`, the `others` it began from too."""
    if target != source:
        for name, other in others.items():
            write_estimates(target, name, other)
    write_estimates(target, block, estimate)
