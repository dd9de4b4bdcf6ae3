"""One step of the direct dynamic model q̈ = M⁻¹(τ − h), linear in states and parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.simulation.integration_steps import IntegrationSteps
from flexcal.errors import FlexcalError


@dataclass(frozen=True, eq=False)
class StateTransition:
    """State transition: `predicted` (2 n,) is [q, q̇] at the end of a step; `by_state` (2 n, 2 n), `by_parameters` (2 n, p) and
    `by_torque` (2 n, n) are its derivatives.
    """

    predicted: np.ndarray
    by_state: np.ndarray
    by_parameters: np.ndarray
    by_torque: np.ndarray


@dataclass(frozen=True, eq=False)
class StateTransitions:
    """Transitions of all `steps` with the mass matrix and the slopes of the torques of the parameters `about` (p,).

    W has the `accelerations` (N, n), rad/s²: the measured ones, smoothed, as their noise biases inertias towards zero. Whatever they
    are, q̈ does not depend on them where `about` is the truth. `corrections` (2, N, n), rad/s², make of the acceleration in the mean of a
    step's samples that which moves the position, and that which moves the velocity.
    """

    steps: IntegrationSteps
    about: np.ndarray
    slopes: np.ndarray
    accelerations: np.ndarray
    corrections: np.ndarray

    @classmethod
    def of(cls, steps: IntegrationSteps, about: np.ndarray, reach: int) -> StateTransitions:
        """Transitions with accelerations smoothed over `reach` samples to either side."""
        width = max(1, round(reach * steps.spacing / steps.length))
        weights = np.hanning(2 * width + 1)[1:-1]
        sums = np.array(
            [np.convolve(column, weights) for column in (*steps.middle.ddq.T, np.ones(len(steps.torque)))]
        )
        inner = sums[:, width - 1 : width - 1 + len(steps.torque)]
        smooth = (inner[:-1] / inner[-1]).T
        return cls(steps, about, steps.slopes(about), smooth, _corrections(smooth, steps))

    def step(self, k: int, state: np.ndarray, parameters: np.ndarray) -> StateTransition:
        """Step `k` from `state` (2 n,) with `parameters` (p,); raises `FlexcalError` if M is not positive definite."""
        steps, h = self.steps, self.steps.length
        n = len(state) // 2
        q, dq = state[:n], state[n:]
        mass = steps.inertia[k] @ self.about
        if np.linalg.eigvalsh(mass)[0] <= 0:
            raise FlexcalError(
                "E-DYN-044",
                f"the mass matrix of {steps.observation.model.path} is not positive definite with the filter's parameters; give CAD "
                "inertias and `drives: {rotor_inertia: […]}` nearer to the truth, or take --estimator wls.",
            )
        push = np.linalg.inv(mass)
        by_position, by_speed = self.slopes[:, k]
        moved = by_position @ (q + 0.5 * h * dq - steps.state[k, 0]) + by_speed @ (dq - steps.speed[k])
        ddq = self.accelerations[k]
        columns = steps.columns[k] + np.tensordot(ddq - steps.middle.ddq[k], steps.inertia[k], axes=(0, 1))
        ddq = ddq + push @ (steps.torque[k] - moved - columns @ parameters)
        onward = np.vstack([0.5 * h**2 * push, h * push])
        by_state = np.eye(2 * n)
        by_state[:n, n:] = h * np.eye(n)
        by_state -= onward @ np.hstack([by_position, by_speed])
        for_position, for_speed = self.corrections[:, k]
        predicted = np.concatenate(
            [q + h * dq + 0.5 * h**2 * (ddq + for_position), dq + h * (ddq + for_speed)]
        )
        return StateTransition(predicted, by_state, -onward @ columns, onward)


def _corrections(accelerations: np.ndarray, steps: IntegrationSteps) -> np.ndarray:
    """Corrections of the trapezoidal mean over samples, which exceeds that of the motion by a″/12 times the square of their spacing, and
    of a position under constant acceleration: a changing one moves it by a′h/6 less. Both would count as (ωh)²/12 of the inertia.
    """
    if len(accelerations) < 3:
        return np.zeros((2, *accelerations.shape))
    rate = np.gradient(accelerations, steps.length, axis=0)
    for_speed = -(steps.spacing**2) / 12 * np.gradient(rate, steps.length, axis=0)
    return np.stack([for_speed - steps.length / 6 * rate, for_speed])
