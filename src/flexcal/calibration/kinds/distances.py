"""Distances: a draw-wire from an anchor, or contact with a sphere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.kinds.kind import Kind
from flexcal.calibration.kinds.robust_start import (
    FLAT,
    PASSES,
    cauchy_weights,
    require_fitting,
    require_targets,
    station_numbers,
)
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.estimation import Parameter, Parameters
from flexcal.model.robot import STATION, RobotModel

if TYPE_CHECKING:
    from flexcal.calibration.measurement import PredictedMeasurements

_OWN = ("zero", "scale")


class Distances(Kind):
    """Distance from the station's origin, from a `zero` of its own, and of a wire in lengths of its own `scale`.

    A drum that is larger by one per mille reads one per mille too little; that is the scale.
    """

    def rows(self, poses: PoseSet) -> np.ndarray:
        """As `Kind.rows`."""
        return poses.far

    def read(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """As `Kind.read`: the first coordinate is the distance."""
        number = [model.station_index(name) for name in station.tolist()]
        readings = np.zeros_like(located)
        readings[:, 0] = np.linalg.norm(located, axis=1) - model.stations.zero[number]
        readings[:, 0] /= 1 + model.stations.wire_scale[number]
        return readings

    def slopes(self, model: RobotModel, station: np.ndarray, located: np.ndarray) -> np.ndarray:
        """As `Kind.slopes`."""
        scale = np.array([model.stations.wire_scale[model.station_index(name)] for name in station.tolist()])
        length = np.linalg.norm(located, axis=1, keepdims=True) * (1 + scale[:, None])
        slopes = np.zeros((len(located), 3, 3))
        slopes[:, 0] = np.divide(located, length, out=np.zeros_like(located), where=length > 0)
        return slopes

    def uncertain(self, model: RobotModel, poses: PoseSet) -> tuple[Parameters, np.ndarray]:
        """As `Kind.uncertain`: the scales of the wires; spheres have no length."""
        declared = model.config.measurements
        stds = {
            f"station.{name}.scale": item.scale_std
            for name, item in declared.items()
            if item.kind == "wire" and (poses.far & (poses.station == name)).any()
        }
        items = Parameters(Parameter(name, "1", model.value(name)) for name in stds)
        return items, np.diag(np.square(list(stds.values())))

    def owns(self, name: str) -> bool:
        """As `Kind.owns`."""
        return name.startswith("station.") and name.rpartition(".")[2] in _OWN

    def column(self, at: PredictedMeasurements, name: str) -> np.ndarray:
        """As `Kind.column`."""
        station, _, key = name.removeprefix("station.").rpartition(".")
        own = np.flatnonzero(at.poses.far & (at.poses.station == station))
        scale = 1 + at.model.stations.wire_scale[at.model.station_index(station)]
        column = np.zeros((len(at.readings.row), 3))
        column[own, 0] = -(1.0 if key == "zero" else at.position[own, 0]) / scale
        return column

    def start(
        self, model: RobotModel, station: str, targets: np.ndarray, readings: np.ndarray
    ) -> dict[str, float]:
        """As `Kind.start`."""
        require_targets(station, targets, 5)
        centre = np.median(targets, axis=0)
        extents = np.linalg.svd(targets - centre, compute_uv=False)
        if extents[2] < FLAT * extents[0]:
            raise FlexcalError(
                "E-CAL-021",
                f"the positions measured from '{station}' lie in a plane, on either side of which it could be; measure poses distributed "
                "in space.",
            )
        anchor, zero, misfit = _centre_of_distances(targets - centre, readings[:, 0])
        require_fitting(model, station, misfit, targets)
        return station_numbers(-(anchor + centre), np.zeros(3), zero)

    def place(self, model: RobotModel, poses: PoseSet, station: str, *, turned: bool) -> Sequence[str]:
        """As `Kind.place`."""
        return (*STATION[:3], "zero")

    def tells_lengths(self, poses: PoseSet) -> bool:
        """As `Kind.tells_lengths`: wires do, touched spheres of unknown radius do not."""
        return bool((poses.far & (poses.position[:, 0] > 0)).any())


def _centre_of_distances(points: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Point (3,) and zero, m, with |p - centre| = length + zero, and the misfit (N,): linear first, then by Gauss-Newton."""
    known = np.ptp(lengths) > 0
    columns = np.column_stack([2 * points, np.ones(len(points)), *([2 * lengths] if known else [])])
    squares = (points**2).sum(axis=1) - lengths**2
    solution = np.linalg.lstsq(columns, squares, rcond=None)[0]
    weights = np.ones(len(points))
    for _ in range(PASSES):
        root = np.sqrt(weights)
        solution = np.linalg.lstsq(root[:, None] * columns, root * squares, rcond=None)[0]
        weights = cauchy_weights(squares - columns @ solution)
    centre = solution[:3]
    zero = float(solution[4]) if known else float(np.sqrt(max(solution[3] + centre @ centre, 0.0)))
    for _ in range(PASSES):
        away = points - centre
        distance = np.linalg.norm(away, axis=1)
        misfit = lengths + zero - distance
        root = np.sqrt(cauchy_weights(misfit))
        slopes = np.column_stack([-away / distance[:, None], -np.ones(len(points))])
        step = np.linalg.lstsq(root[:, None] * slopes, root * misfit, rcond=None)[0]
        centre, zero = centre + step[:3], zero + float(step[3])
    return centre, zero, lengths + zero - np.linalg.norm(points - centre, axis=1)
