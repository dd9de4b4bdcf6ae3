"""Measured frequency response and that of the fitted model, as plotted in reports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.elasticity.identification import SpringFit
from flexcal.model.robot import RobotModel


@dataclass(frozen=True, eq=False)
class FittedResponse:
    """L lines of n axes in the pose of number `pose` at `q_mean` (all joints,) rad, with `payload` kg.

    `frequencies_hz` (L,); `response` measured and `predicted` by the model (L, n, n) complex; `std`, and of it `noise_std` and
    `distortion_std`, (L, n, n), 1σ of the measured one, with so many `degrees_of_freedom`; `misfit` (n, n) as in `SpringFit`.
    Of S `sensors` on the arm, which read in `sensor_units`: `sensor_response` measured and `sensor_predicted` (L, S, n).
    """

    pose: int
    joints: tuple[str, ...]
    q_mean: np.ndarray
    payload: float
    frequencies_hz: np.ndarray
    response: np.ndarray
    predicted: np.ndarray
    std: np.ndarray
    noise_std: np.ndarray
    distortion_std: np.ndarray
    misfit: np.ndarray
    degrees_of_freedom: float
    sensors: tuple[str, ...]
    sensor_units: tuple[str, ...]
    sensor_response: np.ndarray
    sensor_predicted: np.ndarray


def fitted_responses(result: SpringFit, robot: RobotModel) -> tuple[FittedResponse, ...]:
    """Fitted responses of every pose; `robot` has the payload of those without one."""
    declared = robot.payload.mass if robot.payload is not None else 0.0
    return tuple(
        FittedResponse(
            pose=measured.pose,
            joints=measured.joints,
            q_mean=measured.q_mean,
            payload=declared if measured.payload is None else measured.payload,
            frequencies_hz=measured.frequencies_hz,
            response=measured.response,
            predicted=predicted,
            std=measured.std,
            noise_std=measured.noise_std,
            distortion_std=measured.distortion_std,
            misfit=misfit,
            degrees_of_freedom=measured.degrees_of_freedom,
            sensors=measured.sensors,
            sensor_units=tuple(robot.sensors[name].unit for name in measured.sensors),
            sensor_response=measured.stacked[:, len(measured.joints) :],
            sensor_predicted=sensed,
        )
        for measured, predicted, misfit, sensed in zip(
            result.responses, result.predicted, result.misfit, result.sensed, strict=True
        )
    )
