"""A measured frequency response and the fitted model's, as the reports draw them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.elasticity import StiffnessResult
from flexcal.model import RobotModel


@dataclass(frozen=True, eq=False)
class FittedResponse:
    """L lines of n axes in the pose of number `pose` at `q_mean` (all joints,) rad, with `payload` kg.

    `frequencies_hz` (L,); `response` measured and `predicted` by the model (L, n, n) complex; `std`, and of it `noise_std` and
    `distortion_std`, (L, n, n), 1σ of the measured one, with so many `degrees_of_freedom`; `misfit` (n, n) as in `StiffnessResult`.
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


def fitted_responses(result: StiffnessResult, robot: RobotModel) -> tuple[FittedResponse, ...]:
    """Of every pose of a fit; `robot` has the payload of those that say nothing of it."""
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
        )
        for measured, predicted, misfit in zip(result.responses, result.predicted, result.misfit, strict=True)
    )
