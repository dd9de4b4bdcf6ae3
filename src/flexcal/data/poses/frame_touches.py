"""Poses in which the tip of a tool touches the work object, and the coordinates of the tip in the work object's frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexcal.data.poses.touches import Touches

FrameMethod = Literal["points", "faces", "origin_x_xy", "x1_x2_y1"]
"""How touches define the frame: points of known coordinates, three faces (3-2-1), origin and points of the x axis and the xy plane, or
two points of the x axis and one of the y axis."""
FREE = float("nan")
KNOWN_BY_NAME: dict[FrameMethod, dict[str, tuple[float, float, float]]] = {
    "faces": {"1": (FREE, FREE, 0.0), "2": (FREE, 0.0, FREE), "3": (0.0, FREE, FREE)},
    "origin_x_xy": {"origin": (0.0, 0.0, 0.0), "x": (FREE, 0.0, 0.0), "xy": (FREE, FREE, 0.0)},
    "x1_x2_y1": {"x1": (FREE, 0.0, 0.0), "x2": (FREE, 0.0, 0.0), "y1": (0.0, FREE, 0.0)},
}
"""Coordinates that the name of what was touched tells, m; the others are free."""


@dataclass(frozen=True, eq=False)
class FrameTouches:
    """N touches of a work object.

    Parameters
    ----------
    touches : Touches
        The poses; `touched` names the points or faces.
    known : ndarray
        Coordinates (N, 3) of the tip in the work object's frame, m; NaN where a touch does not tell one.
    method : FrameMethod
        What defines the frame.
    """

    touches: Touches
    known: np.ndarray
    method: FrameMethod

    def __len__(self) -> int:
        return len(self.touches)
