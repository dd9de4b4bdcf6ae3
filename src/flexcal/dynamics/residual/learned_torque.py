"""Learned residual torque of each motor as a function of its position, speed and predicted torque."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.residual.gaussian_process import GaussianProcess
from flexcal.errors import FlexcalError


@dataclass(frozen=True, eq=False)
class LearnedMotor:
    """Residual torque of the motor of joint `name`: `process`, a function of the axis' position, speed and predicted torque.

    `inflation` is what the standard deviations of the process have to be multiplied by, as the errors of left-out blocks say.
    """

    name: str
    process: GaussianProcess
    inflation: float

    @property
    def learned(self) -> bool:
        """Whether cross-validation supports the process; else its mean is zero, and its standard deviation the error without it."""
        return self.process.amplitude > 0


@dataclass(frozen=True, eq=False)
class LearnedResidual:
    """Learned processes, one per motor, in the order of the joints, `shares` (n, n) as of `motor_shares`.

    It is not part of the parameters, and holds for the estimate alone that it was learned with (Nguyen-Tuong and Peters 2010).
    """

    motors: tuple[LearnedMotor, ...]
    shares: np.ndarray

    @property
    def learned(self) -> tuple[str, ...]:
        """Motors with a learned process."""
        return tuple(motor.name for motor in self.motors if motor.learned)

    def torque(self, q: np.ndarray, dq: np.ndarray, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Correction of the torques `predicted` (N, n), N m, by the estimate at `q`, `dq` (N, n), and the standard deviation (N, n) of
        measured ones, noise included. Raises `FlexcalError` for shapes that differ or do not fit the motors.
        """
        shapes = {values.shape for values in (q, dq, predicted)}
        if len(shapes) > 1 or q.shape[1:] != (len(self.motors),):
            raise FlexcalError(
                "E-DYN-028",
                f"q, dq and predicted have shapes {q.shape}, {dq.shape} and {predicted.shape}; give (samples, {len(self.motors)}) of each.",
            )
        position, velocity = q @ self.shares.T, dq @ self.shares.T
        return self.of_motors(position, velocity, predicted @ np.linalg.inv(self.shares))

    def of_motors(
        self, position: np.ndarray, velocity: np.ndarray, predicted: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Same as `torque` from positions, speeds and predicted torques on the axes of the motors (N, n)."""
        mean, variance = np.zeros_like(predicted), np.zeros_like(predicted)
        for k, motor in enumerate(self.motors):
            inputs = motor_inputs(position, velocity, predicted, k)
            mean[:, k], std = motor.process.predict(inputs)
            variance[:, k] = (motor.inflation * std) ** 2
        return mean @ self.shares, np.sqrt(variance @ self.shares**2)


def motor_inputs(position: np.ndarray, velocity: np.ndarray, predicted: np.ndarray, motor: int) -> np.ndarray:
    """Inputs (N, 3) of the process of one motor, out of those of all motors (N, n)."""
    return np.stack([position[:, motor], velocity[:, motor], predicted[:, motor]], axis=1)
