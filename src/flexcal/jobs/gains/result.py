"""Identified drive gains of a robot, and the content of their results.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.estimation import Estimate
from flexcal.jobs.gains.split_halves import SplitHalfGains
from flexcal.jobs.pages import ReportedResult, estimate_row
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header, quantities
from flexcal.report.checks import Trust, gain_checks


@dataclass(frozen=True, eq=False, repr=False)
class GainsIdentification(ReportedResult):
    """Result of `identify_gains`: factors of the drive gains that robot.yaml declares; not stored in estimates.yaml.

    Attributes
    ----------
    model : RobotModel
        The robot as it was given; the line of `signals: tau:` takes the gains.
    estimate : Estimate
        Factors `<joint>.drive_gain` of the declared gains.
    halves : SplitHalfGains, optional
        Factors from each half of the recordings, where a half alone determines them.
    declared : ndarray, shape (n,)
        Gains of `signals: tau:`, 1 where there are none.
    payloads : tuple of float
        Payload of every log, kg.
    signals : mapping
        Filters and decimation, as results.json has them.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    estimate: Estimate
    halves: SplitHalfGains | None
    declared: np.ndarray
    payloads: tuple[float, ...]
    signals: Mapping[str, Any]
    record: RunRecord = NOT_RECORDED

    @property
    def gains(self) -> list[float]:
        """Declared gains times factors (n,); as declared if the recordings do not determine the factor."""
        factors = zip(
            self.declared, self.estimate.parameters.coordinates(), self.estimate.identifiable, strict=True
        )
        return [float(gain * factor) if told else float(gain) for gain, factor, told in factors]

    @property
    def headline(self) -> str:
        """Gains, and the number of those that the recordings determine."""
        gains = ", ".join(f"{gain:.5g}" for gain in self.gains)
        return f"gains {gains}; {sum(self.estimate.identifiable)} of {len(self.gains)} determined"

    def summary(self) -> str:
        """Every factor with its standard deviation, and the verdict."""
        rows = [estimate_row(self.estimate, item.name) for item in self.estimate.parameters]
        return "\n".join([self.headline, *rows, self.trust.sentence])

    @property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(gain_checks(quantities(self.estimate), self._halves))

    @property
    def _halves(self) -> dict[str, Any] | None:
        return None if self.halves is None else self.halves.document()

    def write_arrays(self, folder: Path) -> None:
        """Write no arrays: the page shows the results alone."""

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {
            **header("gains"),
            "robot": self.model.name,
            "parameters": quantities(self.estimate),
            "halves": self._halves,
            "verdict": self.trust.document(),
            "declared_gains": list(self.declared),
            "gains": self.gains,
            "signals": dict(self.signals),
            "payloads_kg": list(self.payloads),
            **self.record.document(),
        }
