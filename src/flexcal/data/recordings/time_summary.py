"""Treatment of the time stamps of a log, in words."""

from __future__ import annotations

from dataclasses import dataclass, field

from flexcal.data.recordings.time_base import TimeBase

_SHOWN = 1e-4
"""Least share of out-of-order and repeated samples that is reported, at least one."""


@dataclass
class TimeSummary:
    """Summary of the `bases` of a log's blocks; `short` are seconds between gaps that are too short for the filters."""

    bases: list[TimeBase] = field(default_factory=list)
    short: float = 0.0

    def add(self, base: TimeBase) -> None:
        """Add the base of the next block."""
        self.bases.append(base)

    @property
    def sentence(self) -> str:
        """Sentence on the treatment of time stamps; empty if they are uniform."""
        return "; ".join((*self._resampled(), *self._divided(), *self._repaired()))

    def _resampled(self) -> list[str]:
        bases = [base for base in self.bases if base.resampled or base.even]
        if not bases:
            return []
        step = bases[0].time_step
        if bases[0].even:
            return [
                f"time stamps scatter or are rounded: the positions are smooth if samples are {_ms(step)} apart, as which they are taken"
            ]
        lost = sum(base.lost for base in bases)
        jitter = max(base.jitter_max for base in bases)
        if bases[0].regular and jitter <= 0.02 * step:
            return [f"{_count(lost, 'lost sample')} interpolated"]
        shortest = min(base.shortest for base in bases)
        longest = max(base.longest for base in bases)
        words = f"time stamps are {_ms(shortest)} to {_ms(longest)} apart: values interpolated at them, every {_ms(step)}"
        return [words, *([f"{_count(lost, 'lost sample')} among them"] if lost else [])]

    def _divided(self) -> list[str]:
        gaps = [base.gap for base in self.bases if base.gap > 0]
        if not gaps:
            return []
        longest = "" if len(gaps) == 1 else ", the longest"
        words = f"divided at {_count(len(gaps), 'gap')}{longest} of {max(gaps):.3g} s, over which nothing is interpolated"
        if self.short:
            words += f"; {self.short:.2g} s between gaps are too short for the filters and left out"
        return [words]

    def _repaired(self) -> list[str]:
        kinds = {
            "out of order by their time stamps, and sorted": sum(base.sorted for base in self.bases),
            "of the same time stamp as others, and averaged": sum(base.merged for base in self.bases),
            "that repeat the one before while the robot moves left out": sum(
                base.repeated for base in self.bases
            ),
        }
        return [f"{_count(number, 'row')} {what}" for what, number in kinds.items() if number]


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
