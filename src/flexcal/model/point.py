"""What the instrument sees, and what the robot holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Point:
    """A target: `xyz` (3,) in a frame that sits at `rotation`, `translation` in the link of joint `joint`."""

    name: str
    frame: str
    joint: int
    rotation: np.ndarray
    translation: np.ndarray
    xyz: np.ndarray


@dataclass(frozen=True, eq=False)
class Payload:
    """A body held in a frame that sits at `rotation`, `translation` in the link of joint `joint`.

    `mass` kg with standard deviation `mass_std`, `com` (3,) in the frame, `inertia` (3, 3) about the centre of mass in frame axes.
    """

    frame: str
    joint: int
    rotation: np.ndarray
    translation: np.ndarray
    mass: float
    mass_std: float
    com: np.ndarray
    inertia: np.ndarray

    @property
    def com_in_link(self) -> np.ndarray:
        """Centre of mass (3,) in the frame of the link that carries the payload, m."""
        return self.translation + self.rotation @ self.com
