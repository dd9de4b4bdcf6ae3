"""Path of the file of an identification's estimate."""

from __future__ import annotations

from pathlib import Path

from flexcal.files.formats import Block, require_place

ESTIMATES = "estimates.yaml"


def estimates_target(source: Path, out: Path | None, block: Block) -> Path:
    """Path of the file for an identification's block: in the folder `out`, else the robot's own `source`.

    Raises `InputError` where that cannot take the block, as one that another program wrote.
    """
    target = source if out is None else out / ESTIMATES
    require_place(target, block)
    return target
