"""File of an identification's estimate."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from flexcal.estimation import Estimate
from flexcal.files.formats import Block, require_place, write_estimates

ESTIMATES = "estimates.yaml"


def estimates_target(source: Path, out: Path | None, block: Block) -> Path:
    """The file into which an identification puts its block: in the folder `out`, else the robot's own `source`.

    Raises `InputError` where that cannot take the block, as one that another program wrote.
    """
    target = source if out is None else out / ESTIMATES
    require_place(target, block)
    return target


def store_block(
    source: Path, target: Path, others: Mapping[Block, Estimate], block: Block, estimate: Estimate
) -> None:
    """Write `estimate` as `block` of the file `target`; where that is not the robot's own `source`, the `others` it began from too."""
    if target != source:
        for name, other in others.items():
            write_estimates(target, name, other)
    write_estimates(target, block, estimate)
