"""Growth of a robot's lengths between calibrations at different temperatures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.estimation import Estimate
from flexcal.model.kinematics import link_vectors, point_ends
from flexcal.model.robot import REFERENCE, RobotModel

TEMPERATURE = "temperature"
"""Name of the range of measured temperatures in a block `calibration`."""
GROWTH = "growth"
"""Name of the relative growth of all lengths among the causes of a change."""
EXPANSION, SPREAD = 15e-6, 5e-6
"""Mean and standard deviation of the expansion of arms, 1/K: steel has 12 µm/m/K, aluminium 23."""
ALUMINIUM = 25e-6
"""Expansion of arms at most, 1/K."""
_LINK = 5e-6
"""Standard deviation of the expansion of a link beside that of the arm, 1/K."""
_ARM = 1.0
"""Standard deviation of the arm's temperature beside the measured one, K."""


def temperature_of(estimate: Estimate) -> float | None:
    """Temperature, °C, that the lengths of a calibration are of: the reference of its thermal term, else the middle of those measured."""
    if REFERENCE in estimate.parameters:
        return float(estimate.values[REFERENCE])
    if TEMPERATURE in estimate.ranges:
        return sum(estimate.ranges[TEMPERATURE]) / 2
    return None


def growth_columns(model: RobotModel, poses: PoseSet, positions: np.ndarray) -> np.ndarray:
    """Displacements (3 N, 1 + n) of points at `positions` (N, 3), base frame, by the relative growth of all lengths and of each link."""
    grown = np.empty((len(poses), len(model.joints), 3))
    for name, end in point_ends(model, poses.target).items():
        own = poses.target == name
        grown[own] = link_vectors(model, poses.q[own], end)
    columns = np.concatenate([positions[:, None], grown], axis=1)
    return columns.swapaxes(1, 2).reshape(3 * len(poses), -1)


@dataclass(frozen=True, eq=False)
class ThermalGrowth:
    """What temperatures do to K calibrations in r combinations of parameters.

    `expected` (K, r) is the growth of an arm of mean expansion; `sources` (K r, s) are columns of unit variance of what is not known of it:
    the expansion of arm and links, the same at all calibrations, and the arm's own temperature at each.
    """

    expected: np.ndarray
    sources: np.ndarray

    @classmethod
    def of(cls, temperatures: np.ndarray | None, columns: np.ndarray) -> ThermalGrowth:
        """Growth at `temperatures` (K,), °C, of combinations with derivatives `columns` (r, 1 + n) by that of all lengths and of each link;
        none where they are not known.
        """
        rank = len(columns)
        if temperatures is None:
            return cls(np.zeros((1, rank)), np.zeros((0, 0)))
        rise = temperatures - temperatures.mean()
        sizes = np.r_[SPREAD, np.full(columns.shape[1] - 1, _LINK)]
        arm = np.kron(np.eye(len(rise)), EXPANSION * _ARM * columns[:, [0]])
        return cls(
            np.outer(EXPANSION * rise, columns[:, 0]),
            np.hstack([np.kron(rise[:, None], columns * sizes), arm]),
        )
