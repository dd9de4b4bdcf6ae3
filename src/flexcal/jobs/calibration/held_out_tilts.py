"""Errors of a calibration at groups of readings of inclinometers that are left out whole, one group after the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.verification import MILLIRADIAN, TiltStatistics, tilt_differences
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel


@dataclass(frozen=True, eq=False)
class HeldOutTilts:
    """Errors, rad or 1, at the `groups` by name, each left out of its own calibration; `by` names what groups the readings.

    `left_out` wrong readings are in no group.
    """

    by: str
    groups: Mapping[str, TiltStatistics]
    left_out: int = 0

    @property
    def mean(self) -> float:
        """Mean over the groups of their mean errors, rad or 1."""
        return float(np.mean([group.mean for group in self.groups.values()]))

    def document(self) -> dict[str, Any]:
        """Block `held_out` of results.json."""
        return {
            "by": self.by,
            "groups": {name: group.document() for name, group in self.groups.items()},
            "outliers": self.left_out,
            "mean_mm": None,
            "mean_mrad": self.mean / MILLIRADIAN,
            "distance_mm": None,
        }


def held_out_tilts(
    calibrated: Callable[[PoseSet], RobotModel],
    poses: PoseSet,
    by: str,
    labels: np.ndarray,
    *,
    left_out: int = 0,
) -> HeldOutTilts:
    """Leave out every group of equal `labels` (N,) in turn, and compare its readings with the robot `calibrated` on the rest.

    Mounting and zeros of every inclinometer are those of the rest. Raises `FlexcalError` for fewer than two groups, and where all readings
    of an inclinometer are in one.
    """
    names = list(dict.fromkeys(labels.tolist()))
    if len(names) < 2:
        raise FlexcalError("E-RUN-103", f"'{by}' is the same in all readings; nothing can be held out by it.")
    groups = {}
    for name in names:
        own = labels == name
        alone = set(poses.target[own].tolist()) - set(poses.target[~own].tolist())
        if alone:
            raise FlexcalError(
                "E-RUN-105",
                f"all readings of {', '.join(sorted(alone))} have the {by} '{name}', so nothing else tells how it is mounted; hold out by "
                "a column of which several values have its readings.",
            )
        model = calibrated(poses.subset(~own))
        groups[str(name)] = TiltStatistics.of(tilt_differences(model, poses.subset(own)))
    return HeldOutTilts(by, groups, left_out)
