"""Drive gains from each half of the recordings alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from flexcal.dynamics.drives import drive_gains
from flexcal.dynamics.inverse_model import BaseParameters, Observation
from flexcal.dynamics.regression import ExperimentSystem, RegressionData
from flexcal.errors import FlexcalError
from flexcal.report.results import ParameterChanges, parameter_changes


@dataclass(frozen=True)
class SplitHalfGains:
    """Factors of the gains from each half alone, and their differences."""

    changes: ParameterChanges

    def document(self) -> dict[str, Any]:
        """Block `halves` of results.json."""
        return {
            "probability": self.changes.probability,
            "factors": {
                change.name: {"first": change.values[0], "second": change.values[1], "score": change.score}
                for change in self.changes.changes
            },
        }


def half_gains(
    observation: Observation,
    base: BaseParameters,
    systems: Sequence[ExperimentSystem],
    payloads: Sequence[float],
) -> SplitHalfGains | None:
    """`drive_gains` from the first and the second half of every recording; None where a half alone does not determine them."""
    if min(len(system.batches) for system in systems) < 2:
        return None
    halves = zip(*(_halves(system) for system in systems), strict=True)
    try:
        first, second = (drive_gains(RegressionData.of(observation, base, half), payloads) for half in halves)
    except FlexcalError:
        return None
    changes = parameter_changes(first, second)
    return SplitHalfGains(changes) if changes.changes else None


def _halves(system: ExperimentSystem) -> tuple[ExperimentSystem, ExperimentSystem]:
    middle = len(system.batches) // 2
    return replace(system, batches=system.batches[:middle]), replace(system, batches=system.batches[middle:])
