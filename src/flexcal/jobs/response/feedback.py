"""Effect of a controller on the measured response of an axis: check, sentence, and block of results.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexcal.frequency.arbitrary import ExcitationRecord, Feedback, LocalResponse, feedback
from flexcal.report.layout import percent

MOSTLY = 0.5
"""Share of fed-back noise in the input from which a line reflects the controller more than the axis."""
_NEARLY_ALL = 0.95
_SEEMS = "a controller seems to act on the output"
_HARDLY = 0.01
"""Bias below which no warning is given."""


def line_noise_share(share: np.ndarray, periods: int | None) -> np.ndarray:
    """Share of noise at the lines of a periodic excitation, from the share over all frequencies."""
    return share / (share + (1.0 - share) * (periods or 1))


def references_free_of_feedback(pieces: Sequence[ExcitationRecord], at_once: Sequence[bool]) -> bool:
    """Whether the references of the records are free of output noise, and so valid as references."""
    loop = feedback([replace(piece, inputs=piece.references) for piece in pieces], at_once)
    return loop is not None and not loop.acts


@dataclass(frozen=True)
class FeedbackCheck:
    """Check for feedback: `acts` tells whether a controller acts on the output (None if undecidable).

    In the band of the response: the median `share` of noise in the input that it feeds back, the `bias` of the response by it, relative
    and median, and what that exceeds at one line in twenty, `worst`, the most at `worst_hz`. All are zero where a `reference` tells noise
    from excitation.
    """

    acts: bool | None
    share: float = 0.0
    bias: float = 0.0
    worst: float = 0.0
    worst_hz: float = 0.0
    reference: str = ""
    guessed: bool = False

    @classmethod
    def of(
        cls,
        loop: Feedback | None,
        response: LocalResponse,
        periods: int | None,
        references: Sequence[str],
        *,
        guessed: bool,
    ) -> FeedbackCheck:
        """Check within the band of a response with `periods` of a periodic excitation."""
        acts = None if loop is None else loop.acts
        if references or loop is None:
            return cls(acts, reference=", ".join(references), guessed=guessed)
        lines = response.frequencies_hz
        share = loop.share_at(lines)
        of_lines = line_noise_share(share, periods)
        bias = loop.bias_at(lines) * of_lines / np.maximum(share, np.finfo(float).tiny)
        at = int(bias.argmax())
        return cls(
            acts,
            float(np.median(of_lines)),
            float(np.median(bias)),
            float(np.quantile(bias, _NEARLY_ALL)),
            float(lines[at]),
        )

    @property
    def remark(self) -> str:
        """Remark for console and page."""
        if self.reference:
            lead = f"{_SEEMS}; " if self.guessed else ""
            return (
                f"{lead}the part of the input that {self.reference} explains takes its place, so that noise which a controller feeds back "
                "does not bias the response"
            )
        if self.acts is None:
            return (
                "the input is taken to be independent of the output's noise; if a controller acts on that output, the response is biased, "
                "and --reference COLUMN (what the controller was asked for) avoids it"
            )
        if not self.acts:
            return "no controller is seen to act on the output: the input holds nothing of the output's noise"
        if self.worst < _HARDLY:
            return (
                f"{_SEEMS}; in this band it feeds back too little noise to bias the response (by less than "
                f"{percent(self.worst)} at 19 of 20 lines)"
            )
        return (
            f"{_SEEMS}, and {percent(self.share)} of the input (median) is noise that it feeds back: the response "
            f"is biased by about {percent(self.bias)} (median; {percent(self.worst)} or more at one line in twenty, the most near "
            f"{self.worst_hz:.3g} Hz), which the intervals do not contain; --reference COLUMN (what the controller was asked for, or what "
            "was added in the loop) avoids it, stronger excitation lowers it"
        )

    def document(self) -> dict[str, Any]:
        """As results.json has it."""
        return {
            "acts": self.acts,
            "share": self.share,
            "bias": self.bias,
            "worst_bias": self.worst,
            "worst_hz": self.worst_hz,
            "reference": self.reference,
        }
