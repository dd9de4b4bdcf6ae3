"""Colours of numbers: from grey over blue to orange, as in the report's map of accuracy, in steps that look equal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.report.layout import ELASTIC, RIGID

_LOW = "#a9b6c4"
"""In place of the report's light grey, which could not be seen on a light ground."""
_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


@dataclass(frozen=True)
class ColourScale:
    """Colours of values from `smallest` to `largest`, in any unit; those beyond have the first and the last colour.

    Colours are interpolated in Oklab (Ottosson 2020), in which equal distances look equal.
    """

    largest: float
    smallest: float = 0.0

    @classmethod
    def shared(cls, *values: np.ndarray) -> ColourScale:
        """One scale for several sets of values, such as errors before and after: 99.5 % of them all are below its end."""
        joined = np.concatenate([np.ravel(part) for part in values])
        finite = joined[np.isfinite(joined)]
        return cls(float(np.quantile(finite, 0.995)) if len(finite) else 1.0)

    @classmethod
    def fitted(cls, values: np.ndarray) -> ColourScale:
        """The scale that 99 % of the finite values are within, in which small differences of one set can be seen."""
        finite = values[np.isfinite(values)]
        if not len(finite):
            return cls(1.0)
        low, high = np.quantile(finite, [0.005, 0.995])
        return cls(float(high), float(low)) if high > low else cls(float(high))

    def share(self, values: np.ndarray) -> np.ndarray:
        """Place of `values` on the scale, from 0 to 1."""
        span = self.largest - self.smallest
        place = (np.asarray(values, dtype=float) - self.smallest) / (span if span > 0 else 1.0)
        return np.clip(np.nan_to_num(place, nan=0.0), 0.0, 1.0)

    def colours(self, values: np.ndarray) -> np.ndarray:
        """Red, green and blue (N, 3), 0 to 255, of `values` (N,)."""
        return _colours(self.share(values))

    def steps(self, count: int) -> np.ndarray:
        """`count` colours (count, 3) of equal parts of the scale."""
        return _colours((np.arange(count) + 0.5) / count)


def _colours(share: np.ndarray) -> np.ndarray:
    anchors = np.array([[int(text[k : k + 2], 16) for k in (1, 3, 5)] for text in (_LOW, ELASTIC, RIGID)])
    lab = np.cbrt(_linear(anchors / 255) @ _TO_CONES.T) @ _TO_LAB.T
    mixed = np.stack([np.interp(share, [0.0, 0.5, 1.0], lab[:, k]) for k in range(3)], axis=-1)
    linear = (mixed @ np.linalg.inv(_TO_LAB).T) ** 3 @ np.linalg.inv(_TO_CONES).T
    return np.round(255 * _encoded(np.clip(linear, 0, 1))).astype(np.uint8)


def _linear(encoded: np.ndarray) -> np.ndarray:
    """Intensities of sRGB values (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def _encoded(linear: np.ndarray) -> np.ndarray:
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
