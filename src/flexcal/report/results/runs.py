"""Comparison of two runs from their folders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from flexcal.calibration.comparison import GeometryChange
from flexcal.calibration.error_model import ErrorStatistics
from flexcal.estimation import Estimate
from flexcal.files.formats import BLOCKS, Block
from flexcal.report.results.change_wording import change_sentence
from flexcal.report.results.run_significance import (
    MeanDifference,
    ParameterChanges,
    mean_difference,
    parameter_changes,
)
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False)
class Run:
    """Run of a verb: errors of the calibrated robot (N, 3) m at joint positions `q` (N, n), measured (or true) at `points` (N, 3).

    `before` are the errors of the robot as delivered, where known; `fresh` says that no fit saw the points. `data` are the SHA-256 of the
    measurements by name, `origin` all that the run says of where it comes from.
    """

    name: str
    kind: Literal["calibration", "verification", "demo"]
    robot: str
    q: np.ndarray
    points: np.ndarray
    errors: np.ndarray
    fresh: bool
    before: ErrorStatistics | None = None
    estimates: Mapping[Block, Estimate] = field(default_factory=dict)
    data: Mapping[str, str] = field(default_factory=dict)
    origin: Mapping[str, str] = field(default_factory=dict)

    @property
    def after(self) -> ErrorStatistics:
        """Error statistics of the calibrated robot."""
        return ErrorStatistics.of(self.errors)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Run `second` against run `first`.

    `change` is that of the robot's geometry between two calibrations; where there is none, `no_change_why` says why.
    """

    first: Run
    second: Run
    change: GeometryChange | None = None
    no_change_why: str = ""

    @property
    def verdict(self) -> str:
        """Whether the robot changed, and what of it, in one sentence; empty where that is not known."""
        return "" if self.change is None else change_sentence(self.change)

    @property
    def points(self) -> np.ndarray:
        """Positions (N, 3), m, base frame, of the tool's points at random poses within the joint ranges of both; (0, 3) if not known."""
        return np.zeros((0, 3)) if self.change is None else self.change.points

    @property
    def displacement(self) -> np.ndarray:
        """How far these moved (N, 3), m, the best-fit motion of the whole robot taken out."""
        return np.zeros((0, 3)) if self.change is None else self.change.displacement

    @property
    def std(self) -> np.ndarray:
        """Standard deviations (N,) of the sizes of `displacement`, m."""
        return np.zeros(0) if self.change is None else self.change.std

    @cached_property
    def difference(self) -> MeanDifference:
        """Difference of the mean errors, point by point if both have the same measurements."""
        first, second = self.first, self.second
        same = (
            first.q.shape == second.q.shape
            and np.allclose(first.q, second.q, rtol=0, atol=1e-9)
            and np.allclose(first.points, second.points, rtol=0, atol=1e-9)
        )
        return mean_difference(first.errors, second.errors, paired=same)

    @cached_property
    def changes(self) -> dict[Block, ParameterChanges]:
        """Changes of the parameters, by the blocks that both runs have."""
        pair = self.first.estimates, self.second.estimates
        return {
            block: parameter_changes(pair[0][block], pair[1][block])
            for block in BLOCKS
            if all(block in estimates for estimates in pair)
        }

    @property
    def single_changes(self) -> dict[Block, ParameterChanges]:
        """Those of `changes` that are compared parameter by parameter: not those of calibrations whose robots are compared."""
        return {k: v for k, v in self.changes.items() if k != "calibration" or self.change is None}

    @property
    def shared(self) -> tuple[str, ...]:
        """Names of measurements, and of blocks of estimates, that both runs used."""
        known = set(self.second.data.values())
        named = tuple(name for name, digest in self.first.data.items() if digest in known)
        return named or self._common

    @property
    def _common(self) -> tuple[str, ...]:
        """Number of measured points that both fitted, in words, in whatever files."""
        first, second = (
            set(run.estimates["calibration"].measurements if "calibration" in run.estimates else ())
            for run in (self.first, self.second)
        )
        count = len(first & second)
        return (f"{count} of the same measured points",) if count else ()

    def document(self) -> dict[str, object]:
        """Machine-readable document; lengths in millimetres, `probability` and scores as in `ParameterChanges`."""
        difference = self.difference
        return {
            "runs": [run.name for run in (self.first, self.second)],
            "errors": [run.after.in_millimetres() for run in (self.first, self.second)],
            "difference_mm": {
                "mean": difference.value / MILLIMETRE,
                "low": difference.low / MILLIMETRE,
                "high": difference.high / MILLIMETRE,
                "paired": difference.paired,
                "significant": difference.significant,
            },
            "shared": list(self.shared),
            "parameters": {
                block: {
                    "compared": len(changes.changes),
                    "not_comparable": list(changes.others),
                    "probability": changes.probability,
                    "changed": [
                        {
                            "name": c.name,
                            "unit": c.unit,
                            "estimates": list(c.values),
                            "std": list(c.std),
                            "score": c.score,
                        }
                        for c in changes.beyond
                    ],
                }
                for block, changes in self.changes.items()
            },
            "geometry": None if self.change is None else _change_document(self.change),
            "geometry_not_compared": self.no_change_why or None,
        }


def _change_document(change: GeometryChange) -> dict[str, object]:
    """Numbers of a change of geometry: displacements in millimetres, parameters in SI units."""
    worst = int(np.argmax(change.distance))
    return {
        "verdict": change_sentence(change),
        "changed": change.changed,
        "probability": change.probability,
        "chi2": change.statistic,
        "combinations": change.combinations,
        "degrees_of_freedom": change.freedom if np.isfinite(change.freedom) else None,
        "explanations": [
            {
                "subject": item.subject,
                "parameters": dict(zip(item.names, item.change, strict=True)),
                "std": dict(zip(item.names, item.std, strict=True)),
                "probability": item.probability,
                "alternatives": list(item.alternatives),
            }
            for item in change.explanations
        ],
        "parameters": [
            {
                "name": item.name,
                "unit": item.unit,
                "change": item.change,
                "std": item.std,
                "probability": item.probability,
                "adjusted_probability": item.adjusted,
                "with": list(item.absorbed),
            }
            for item in change.shifts
        ],
        "displacement_mm": {
            **change.statistics.in_millimetres(),
            "std": float(np.sqrt(np.mean(change.std**2))) / MILLIMETRE,
            "worst_at_m": change.points[worst].tolist(),
            "worst_q": change.q[worst].tolist(),
        },
        "joint_ranges": change.ranges.T.tolist(),
    }
