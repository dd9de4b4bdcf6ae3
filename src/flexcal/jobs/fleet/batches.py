"""Robots of a model that are of two batches, by their geometry as a whole."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.fleet import two_groups
from flexcal.jobs.fleet.members import Twin, groups_to_compare
from flexcal.jobs.fleet_prior import Member, geometry_deviations
from flexcal.report.layout import listed

_LEVEL = 0.05
"""Probability that any model's robots are said to be of two groups where none are."""
_PARAMETERS = 3
"""Largest number of parameters that a sentence names."""
_ROBOTS = 40
"""Largest number of robots of a group that a sentence names."""


@dataclass(frozen=True)
class Batches:
    """Robots of a model in two groups, `robots`, whose geometry differs by `separation` standard deviations of a robot within its group;
    `probability` is the p-value of one group, corrected for the number of models.

    `differing` are the parameters that differ most, with the difference of the second group's mean from the first's over the standard
    deviation within them.
    """

    model: str
    robots: tuple[tuple[str, ...], tuple[str, ...]]
    separation: float
    probability: float
    differing: tuple[tuple[str, float], ...]

    @property
    def sentence(self) -> str:
        """Which robots they are, in what they differ, and what follows."""
        first, second = (f"{listed(names, _ROBOTS)} ({len(names)})" for names in self.robots)
        most = ", ".join(f"{name} ({times:+.1f})" for name, times in self.differing)
        return (
            f"the geometry of {self.model} is of two groups of robots (p {_probability(self.probability)}), of two batches, or measured "
            f"otherwise, as with another instrument or at another temperature: {first}, and {second}; they are {self.separation:.2g} "
            f"standard deviations of a robot within its group apart, most in {most}; one prior of both suits neither, so put the "
            "robots of each group into a folder of its own, and run flexcal fleet --prior on that"
        )

    @property
    def of_prior(self) -> str:
        """What that means for a prior of both groups."""
        first, second = (listed(names, _ROBOTS) for names in self.robots)
        return (
            f"the prior is of two groups of robots, {first} and {second}, and suits neither: it tells less of a robot than a prior of its "
            "group would, and one of the smaller group may not fit it"
        )

    def are_among(self, robots: Collection[str]) -> bool:
        """Whether there are robots of both groups among some."""
        return all(any(name in robots for name in names) for names in self.robots)

    def document(self) -> dict[str, Any]:
        """Entry of the JSON document."""
        return {
            "model": self.model,
            "robots": [list(names) for names in self.robots],
            "separation": self.separation,
            "adjusted_probability": self.probability,
            "differing": dict(self.differing),
            "sentence": self.sentence,
        }


def batches_of(calibrated: Sequence[Member], twins: Sequence[Twin]) -> list[Batches]:
    """Models of which the calibrated robots are of two groups; of the `twins`, which probably are one robot, one counts.

    In at most 5 % of fleets any model's robots are said to be where those of each model are of one population.
    """
    again = {twin.robot for twin in twins}
    groups = [[member for member in own if member.name not in again] for own in groups_to_compare(calibrated)]
    found = []
    for own in groups:
        names, values = geometry_deviations(own)
        divided = two_groups(values) if names else None
        if divided is None or divided.probability * len(groups) > _LEVEL:
            continue
        robots = np.array([member.name for member in own])
        found.append(
            Batches(
                own[0].model.name,
                (tuple(robots[~divided.second].tolist()), tuple(robots[divided.second].tolist())),
                divided.separation,
                divided.probability * len(groups),
                _differing(names, values, divided.second),
            )
        )
    return found


def _differing(names: Sequence[str], values: np.ndarray, second: np.ndarray) -> tuple[tuple[str, float], ...]:
    """Parameters with the largest differences between the groups, each over the standard deviation within them."""
    first, last = values[~second], values[second]
    within = np.sqrt((first.var(axis=0) * len(first) + last.var(axis=0) * len(last)) / (len(values) - 2))
    shift = last.mean(axis=0) - first.mean(axis=0)
    times = np.divide(shift, within, out=np.zeros_like(shift), where=within > 0)
    most = [int(k) for k in np.argsort(-np.abs(times))[:_PARAMETERS]]
    return tuple((names[k], float(times[k])) for k in most)


def _probability(value: float) -> str:
    return f"= {value:.2g}" if value > 0.001 else "< 0.001"
