"""Sharpness of images, by the width of their edges."""

from __future__ import annotations

from typing import Any

import numpy as np

_SMOOTHED = 1.0
"""Standard deviation, pixels, of a smoothing that leaves little of the noise of single pixels."""
_STEEP = 99.95
"""Percentile of the slope that is reached at edges, of which there are a few in every direction in any image of things."""
_DIRECTIONS = np.pi / 4 * np.arange(4)
_NEAR = 17
"""Width, pixels, of the surroundings in which the contrast of an edge is taken."""
_ENDS = (2.0, 98.0)
"""Percentiles of brightness between which the contrast of an image is taken."""
_LEAST_CONTRAST = 25.0
"""Contrast, of 255, below which an image shows nothing that has edges."""


def edge_width(cv2: Any, image: np.ndarray) -> float:
    """Standard deviation of the blur, pixels, of the steepest edges of a grey image; infinite where there is no contrast.

    A step of contrast C that is blurred by a normal density of standard deviation s has the slope C / (s √(2π)). Of four directions that
    in which the edges are least steep counts, as along a motion.
    """
    dark, bright = np.percentile(image, _ENDS)
    if bright - dark < _LEAST_CONTRAST:
        return float("inf")
    smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), _SMOOTHED)
    near = np.ones((_NEAR, _NEAR), np.uint8)
    contrast = cv2.dilate(smooth, near) - cv2.erode(smooth, near)
    down, right = np.gradient(smooth)
    widths = []
    for angle in _DIRECTIONS:
        slope = np.abs(np.cos(angle) * right + np.sin(angle) * down)
        steepest = slope >= np.percentile(slope, _STEEP)
        widths.append(float(np.median(contrast[steepest] / slope[steepest])) / np.sqrt(2 * np.pi))
    return float(np.sqrt(max(max(widths) ** 2 - _SMOOTHED**2, 0.0)))
