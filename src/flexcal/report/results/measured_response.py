"""Interface of a measured frequency response, as the reports draw it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np


class MeasuredResponse(Protocol):
    """L lines of the excited axes `joints` (n); a `FrequencyResponse` is one, and a `FittedResponse`."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the axes."""
        ...

    @property
    def frequencies_hz(self) -> np.ndarray:
        """Frequencies (L,), Hz."""
        ...

    @property
    def response(self) -> np.ndarray:
        """Response (L, n, n), complex, rad/s² per N m."""
        ...

    @property
    def std(self) -> np.ndarray:
        """1σ of every element (L, n, n)."""
        ...

    @property
    def noise_std(self) -> np.ndarray:
        """The part of `std` that is noise (L, n, n)."""
        ...

    @property
    def distortion_std(self) -> np.ndarray:
        """The part of `std` that is distortion (L, n, n)."""
        ...


def relative_to_diagonal(std: np.ndarray, response: np.ndarray) -> np.ndarray:
    """`std` over |G| of the diagonal elements (L, n), of arrays (L, n, n)."""
    return np.diagonal(std, axis1=1, axis2=2) / np.abs(np.diagonal(response, axis1=1, axis2=2))


def uncertainty_sentence(responses: Sequence[MeasuredResponse]) -> str:
    """Sentence on the standard deviations at the median line of the diagonal, in place of a figure."""
    first = responses[0]
    share, noise = (
        100 * float(np.median([np.median(relative_to_diagonal(std, r.response)) for r, std in pairs]))
        for pairs in ([(r, r.std) for r in responses], [(r, r.noise_std) for r in responses])
    )
    return (
        f"Grid of {len(first.joints)} by {len(first.joints)} magnitudes against frequency. On the diagonal the standard deviation "
        f"of the mean is {share:.1f} % of the response at the median frequency, {noise:.1f} % from noise alone."
    )
