"""Scores of the innovations of a Kalman filter with fixed parameters, batch by batch."""

from __future__ import annotations

import numpy as np

from flexcal.dynamics.regression import Scores
from flexcal.dynamics.simulation import StateTransition, StateTransitions


class InnovationScores:
    """Gradient of −½ Σ eᵀS⁻¹e by the kept parameters, and the information Σ ψᵀS⁻¹ψ, of the innovations e of one experiment.

    ψ are the derivatives of the predicted positions, which go through the gains of the filter. `root` (k, k) is that of the covariance of
    the parameters: scores are in coordinates in which it is one. Batches have so many steps: `length`.
    """

    def __init__(
        self, parameters: np.ndarray, kept: list[int], root: np.ndarray, position_noise: float, length: int
    ) -> None:
        self._parameters, self._kept, self._root = parameters, kept, root
        self._noise, self._length = position_noise, length
        self._number = 0
        self._state: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        self._by_batch: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def follow(self, models: StateTransitions, torque_noise: np.ndarray, first_speed: float) -> None:
        """Add the scores of the next steps; `torque_noise` (n,) is the standard deviation of a step's mean torque (N m)."""
        steps = models.steps
        n, size = len(torque_noise), self._root.shape[1]
        if steps.begins:
            self._state = None
        for k in range(len(steps.torque)):
            self._number += 1
            if steps.still[k]:
                self._state = None
                continue
            if self._state is None:
                covariance = np.diag(np.repeat([self._noise**2, first_speed**2], n))
                self._state = (
                    np.concatenate([steps.before[k], steps.speed[k]]),
                    covariance,
                    np.zeros((2 * n, size)),
                )
            self._step(models.step(k, self._state[0], self._parameters), steps.after[k], torque_noise)

    def _step(self, model: StateTransition, after: np.ndarray, torque_noise: np.ndarray) -> None:
        assert self._state is not None
        n = len(after)
        _, covariance, slope = self._state
        pushed = model.by_torque * torque_noise
        covariance = model.by_state @ covariance @ model.by_state.T + pushed @ pushed.T
        slope = model.by_state @ slope + model.by_parameters[:, self._kept] @ self._root
        innovation_covariance = covariance[:n, :n] + self._noise**2 * np.eye(n)
        innovation = after - model.predicted[:n]
        weighted = np.linalg.solve(
            innovation_covariance, np.column_stack([innovation, slope[:n], covariance[:n]])
        )
        batch = (self._number - 1) // self._length
        score, information = self._by_batch.get(batch, (0.0, 0.0))
        self._by_batch[batch] = (
            score + slope[:n].T @ weighted[:, 0],
            information + slope[:n].T @ weighted[:, 1 : 1 + slope.shape[1]],
        )
        gain = weighted[:, 1 + slope.shape[1] :].T
        covariance = covariance - gain @ covariance[:n]
        self._state = (
            model.predicted + gain @ innovation,
            0.5 * (covariance + covariance.T),
            slope - gain @ slope[:n],
        )

    @property
    def scores(self) -> Scores:
        """Scores of all steps so far."""
        size = self._root.shape[1]
        length = max(self._by_batch, default=0) + 1
        score, information = np.zeros((length, size)), np.zeros((length, size, size))
        for number, (own, part) in self._by_batch.items():
            score[number], information[number] = own, part
        return Scores(score, information, len(self._by_batch))
