"""Extended Kalman filter: states and parameters together, through the direct dynamic model (Gautier & Poignet 2001)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexcal.dynamics.estimators.innovation_scores import InnovationScores
from flexcal.dynamics.estimators.linear_least_squares import Unknowns, weighted_system
from flexcal.dynamics.estimators.recorded_rows import RecordedRows
from flexcal.dynamics.estimators.wls import noise_levels
from flexcal.dynamics.regression import (
    BatchCovariance,
    RegressionData,
    batches_each,
    covariance_of_scores,
    offset_scores,
    triangular,
)
from flexcal.dynamics.signals import Experiment, Window, slowest_speeds
from flexcal.dynamics.simulation import IntegrationSteps, StateTransition, StateTransitions, discretise_motion
from flexcal.estimation import Estimate

POSITION_NOISE = 1e-5
"""Standard deviation of a measured position, rad or m: R."""
_FIRST_SPEED = 0.1
"""Standard deviation of the initial velocity, rad/s."""
_PASSES = 2
"""Number of passes: the first takes the mass matrix from the initial parameters, the others from the previous result."""
_SHARE = 0.5
"""Standard deviation of a parameter unknown to CAD, relative to the value that explains all torques of a joint alone."""


def kalman_filter(data: RegressionData, recorded: RecordedRows) -> Estimate:
    """Estimate χ̂ after two passes over all experiments, each from CAD with P0, and one Gauss-Newton step; covariance from the
    innovations.

    The state is q, q̇ and χ over steps of 2 ms. With a the measured acceleration, q̈ = a + M⁻¹(τ − W(a) χ), which is the direct model and
    linear in χ but for M: each pass takes that from the one before, the first from what it begins with. P0 is 100 % of every CAD value;
    where CAD has none, half of what would explain all torques of a joint alone, and there rotor inertias, viscous and Coulomb friction
    begin. Q is the torque noise of `noise_levels`, white up to the band of the decimated rows; R is that of positions of 1e-5 rad;
    parameters do not wander. Square-root form by QR, the parameters scaled by P0. The message has the mean normalised innovation
    squared: above one, Q and R are too small. A filter takes innovations for independent, but position noise goes through its states and
    torque noise has a memory: the covariance is that of the innovations' scores, batch by batch (`covariance_of_scores`). Raises
    `FlexcalError` as `noise_levels` does, and where M is not positive definite.
    """
    noise = noise_levels(data)
    system = weighted_system(data, noise)
    unknowns = Unknowns.of(data, system)
    torque = np.reshape(noise, (len(recorded.experiments), -1))
    state = _Filter(data, unknowns)
    for _ in range(_PASSES):
        about = state.parameters.copy()
        state = _Filter(data, unknowns)
        for sigma, (experiment, window) in zip(torque, _recordings(recorded), strict=True):
            for steps in discretise_motion(
                recorded.observation, experiment, window, slowest_speeds(experiment)
            ):
                if steps.begins:
                    state.restart()
                models = StateTransitions.of(steps, about, _smoothing(recorded))
                state.follow(models, _step_noise(sigma, steps, recorded))
    parameters, uncertainty = _settled(state, recorded, torque, unknowns.kept)
    cost = float(np.linalg.norm(system.right - system.matrix @ parameters) ** 2)
    level = state.squares / max(1, state.count)
    message = f"extended Kalman filter; mean normalised innovation squared {level:.3g}, which should be 1"
    freedom = unknowns.freedom(system)
    return unknowns.estimate(
        parameters, uncertainty.covariance, uncertainty.freedom, cost, freedom, message, _PASSES
    )


def _smoothing(recorded: RecordedRows) -> int:
    """Samples to either side over which accelerations are smoothed: below the band of decimated rows; 0 for undecimated ones."""
    return 2 * (recorded.decimation.factor - 1)


def _recordings(recorded: RecordedRows) -> Iterator[tuple[Experiment, Window]]:
    return zip(recorded.experiments, recorded.windows, strict=True)


def _step_noise(sigma: np.ndarray, steps: IntegrationSteps, recorded: RecordedRows) -> np.ndarray:
    """Standard deviation (n,) of the mean torque of a step, N m, for decimated rows with noise `sigma`, white up to their band."""
    return sigma * np.sqrt(recorded.decimation.factor * steps.spacing / steps.length)


def _settled(
    state: _Filter, recorded: RecordedRows, torque: np.ndarray, kept: list[int]
) -> tuple[np.ndarray, BatchCovariance]:
    """All parameters (p,) after one more step with M from the last pass, and the covariance from the scores of the innovations."""
    root, scores = state.root(), []
    for sigma, (experiment, window) in zip(torque, _recordings(recorded), strict=True):
        own: InnovationScores | None = None
        for steps in discretise_motion(recorded.observation, experiment, window, slowest_speeds(experiment)):
            if own is None:
                length = (
                    int(experiment.samples * steps.spacing / steps.length) // batches_each(len(torque)) + 1
                )
                own = InnovationScores(state.parameters, kept, root, POSITION_NOISE, length)
            models = StateTransitions.of(steps, state.parameters, _smoothing(recorded))
            own.follow(models, _step_noise(sigma, steps, recorded), _FIRST_SPEED)
        if own is not None:
            scores.append(own.scores)
    known = root.T @ np.linalg.solve(state.prior, root)
    onward = np.linalg.inv(np.linalg.cholesky(known + sum(e.information.sum(axis=0) for e in scores)))
    begun = np.linalg.solve(root, (state.start - state.parameters)[kept])
    step = onward @ (known @ begun + sum(e.score.sum(axis=0) for e in scores))
    parameters = state.parameters.copy()
    parameters[kept] += root @ onward.T @ step
    settled = [e.of(onward).after(step) for e in scores]
    level = state.squares / max(1, state.count)
    root = root @ onward.T
    offsets = offset_scores(recorded.observation, kept, root)
    return parameters, covariance_of_scores(settled, root, level, offsets, onward @ known @ onward.T)


class _Filter:
    """Estimates and the square root S of their covariance SᵀS, for q, q̇ and the scaled parameters."""

    def __init__(self, data: RegressionData, unknowns: Unknowns) -> None:
        self._kept, self._n = unknowns.kept, data.observation.model.n
        self.parameters, self.prior = _prior(data, unknowns)
        self.start = self.parameters.copy()
        self._scale = np.sqrt(np.diag(self.prior))
        self._root = np.linalg.cholesky(self.prior / np.outer(self._scale, self._scale)).T
        self._state: np.ndarray | None = None
        self._whole = self._root
        self.squares, self.count = 0.0, 0

    def restart(self) -> None:
        """Reset the state of the robot, but not its parameters."""
        if self._state is not None:
            self._root = triangular(self._whole[:, 2 * self._n :])
        self._state = None

    def root(self) -> np.ndarray:
        """Square root (k, k): root · rootᵀ is the covariance of the kept parameters."""
        self.restart()
        return (self._root * self._scale).T

    def follow(self, models: StateTransitions, torque_noise: np.ndarray) -> None:
        """Predict and correct, step by step; `torque_noise` (n,) is the standard deviation of a step's mean torque, N m."""
        steps = models.steps
        for k in range(len(steps.torque)):
            if steps.still[k]:
                self.restart()
                continue
            if self._state is None:
                self._state = self._started(steps.before[k], steps.speed[k])
            self._step(models.step(k, self._state, self.parameters), steps.after[k], torque_noise)

    def _started(self, position: np.ndarray, speed: np.ndarray) -> np.ndarray:
        n, size = self._n, 2 * self._n + len(self._kept)
        self._whole = np.zeros((size, size))
        self._whole[range(2 * n), range(2 * n)] = [POSITION_NOISE] * n + [_FIRST_SPEED] * n
        self._whole[2 * n :, 2 * n :] = self._root
        return np.concatenate([position, speed])

    def _step(self, model: StateTransition, after: np.ndarray, torque_noise: np.ndarray) -> None:
        n, size = self._n, len(self._whole)
        onward = np.eye(size)
        onward[: 2 * n, : 2 * n] = model.by_state
        onward[: 2 * n, 2 * n :] = model.by_parameters[:, self._kept] * self._scale
        noise = np.zeros((n, size))
        noise[:, : 2 * n] = (model.by_torque * torque_noise).T
        square_root = np.vstack([self._whole @ onward.T, noise])
        table = np.zeros((n + len(square_root), n + size))
        table[:n, :n] = POSITION_NOISE * np.eye(n)
        table[n:, :n], table[n:, n:] = square_root[:, :n], square_root
        factor = triangular(table)
        innovation = np.linalg.solve(factor[:n, :n].T, after - model.predicted[:n])
        change = factor[:n, n:].T @ innovation
        self._state = model.predicted + change[: 2 * n]
        self.parameters[self._kept] += self._scale * change[2 * n :]
        self._whole = factor[n:, n:]
        self.squares += float(innovation @ innovation)
        self.count += n


def _prior(data: RegressionData, unknowns: Unknowns) -> tuple[np.ndarray, np.ndarray]:
    """Initial values of all parameters (p,), and P0 (k, k) of the kept ones, including the effect of the others."""
    values = data.observation.values()
    alone = np.full(len(values), np.inf)
    for s in data.subsystems:
        sizes = np.linalg.norm(s.triangle.matrix, axis=0)
        bound = np.linalg.norm(s.triangle.right) / np.where(sizes > 0, sizes, np.inf)
        alone[s.column_indices] = np.where(
            sizes > 0, np.minimum(alone[s.column_indices], bound), alone[s.column_indices]
        )
    alone = np.where(np.isfinite(alone), alone, 0.0)
    std = np.where(values != 0, np.abs(values), _SHARE * alone)
    keys = [name.rpartition(".")[2] for name in data.names]
    positive = np.array([key in ("rotor_inertia", "viscous", "coulomb") for key in keys]) & (values == 0)
    guess = np.where(positive, std, values)
    base = data.base.identifiability
    rows = base.regrouping[[base.kept.index(number) for number in unknowns.kept]]
    start = values.copy()
    start[unknowns.kept] += rows @ (guess - values)
    return start, (rows * std**2) @ rows.T
