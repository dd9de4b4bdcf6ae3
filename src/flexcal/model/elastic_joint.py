"""The springs of one joint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class ElasticJoint:
    """A drive spring and, with `bearings`, two bearing springs at joint `index`.

    `frame` (3, 3) has the bearing's x, y, z as columns in the joint frame, z being the joint axis; `stiffness` (3,) in N m/rad and
    `damping` (3,) in N m s/rad are for tilt about x, tilt about y and the drive (nan without bearings). With `tilts_first` the tilts come
    before the joint's rotation, about axes fixed to the parent link.
    """

    index: int
    name: str
    frame: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    bearings: bool
    tilts_first: bool

    @property
    def components(self) -> tuple[int, ...]:
        """Elastic coordinates from base to tool: 2 twist, 1 tilt about y, 0 tilt about x."""
        if not self.bearings:
            return (2,)
        return (1, 0, 2) if self.tilts_first else (2, 1, 0)
