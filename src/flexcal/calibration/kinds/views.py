"""Views: a camera's pose by a printed board that it sees, or the board's by a camera in the cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.kinds.kind import Kind
from flexcal.data.poses import PoseSet
from flexcal.estimation import Parameter, Parameters
from flexcal.model.robot import BOARD_SCALE, LENS, RobotModel, unit_of

if TYPE_CHECKING:
    from flexcal.calibration.measurement import PredictedMeasurements

_CAMERA = "camera."


class Views(Kind):
    """Coordinates and orientation in the board's axes, in lengths of the board, and with the lens of the view's own fit."""

    def rows(self, poses: PoseSet) -> np.ndarray:
        """As `Kind.rows`."""
        return poses.seen

    def scales(self, poses: PoseSet) -> dict[str, np.ndarray]:
        """As `Kind.scales`: of the board's size."""
        return {BOARD_SCALE: poses.seen} if poses.seen.any() else {}

    def scale_std(self, model: RobotModel, name: str) -> float | None:
        """As `Kind.scale_std`."""
        if name != BOARD_SCALE:
            return None
        declared = model.config.measurements.values()
        return next((item.board.std for item in declared if item.kind == "camera"), None)

    def shift(self, at: PredictedMeasurements) -> np.ndarray | None:
        """As `Kind.shift`: by lenses that differ from those that the poses were measured with.

        None for a camera whose parameters the robot does not have, as before a calibration.
        """
        if not at.poses.seen.any():
            return None
        lenses, shift = at.model.lenses, np.zeros((len(at.readings.row), 3))
        for name, lens in at.poses.lenses.items():
            if name in lenses.names:
                values = lenses.values[lenses.names.index(name)]
                shift += np.matmul(_by_lens(at, name), values - lens.values)
        return shift

    def uncertain(self, model: RobotModel, poses: PoseSet) -> tuple[Parameters, np.ndarray]:
        """As `Kind.uncertain`: the intrinsic parameters of the cameras that measured, as their free views determine them."""
        used = {
            name: lens
            for name, lens in poses.lenses.items()
            if poses.camera is not None and (poses.camera == name).any()
        }
        items = [
            Parameter(f"{_CAMERA}{name}.{key}", unit_of(key), float(value))
            for name, lens in used.items()
            for key, value in zip(LENS, lens.values, strict=True)
        ]
        covariance = np.zeros((len(items), len(items)))
        for k, lens in enumerate(used.values()):
            own = slice(k * len(LENS), (k + 1) * len(LENS))
            covariance[own, own] = lens.covariance
        return Parameters(items), covariance

    def owns(self, name: str) -> bool:
        """As `Kind.owns`."""
        return name.startswith(_CAMERA) or name == BOARD_SCALE

    def column(self, at: PredictedMeasurements, name: str) -> np.ndarray:
        """As `Kind.column`."""
        if name == BOARD_SCALE:
            return super().column(at, name)
        camera, _, key = name.removeprefix(_CAMERA).rpartition(".")
        return -_by_lens(at, camera)[:, :, LENS.index(key)]


def _by_lens(at: PredictedMeasurements, camera: str) -> np.ndarray:
    """Change (R, 3, 9) of the measured poses with the intrinsic parameters of a camera."""
    own = at.poses.by_lens
    assert own is not None and at.poses.camera is not None
    mine = np.where((at.poses.camera == camera)[:, None, None], own, 0.0)
    return np.concatenate([mine[:, :3], mine[at.poses.angled, 3:]])
