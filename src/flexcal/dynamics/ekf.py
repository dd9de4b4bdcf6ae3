"""Extended Kalman filter: states and parameters together, through the direct dynamic model (Gautier & Poignet 2001)."""

from __future__ import annotations

import numpy as np

from flexcal.dynamics.batch_covariance import batch_covariance
from flexcal.dynamics.forward_steps import ForwardSteps, forward_steps
from flexcal.dynamics.linear_fit import Unknowns, weighted_system
from flexcal.dynamics.recorded_rows import RecordedRows
from flexcal.dynamics.regression import RegressionData
from flexcal.dynamics.rows import slowest_speeds
from flexcal.dynamics.triangle import triangular
from flexcal.dynamics.wls import noise_levels
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate

POSITION_NOISE = 1e-5
"""Standard deviation of a measured position, rad or m: R."""
_FIRST_SPEED = 0.1
"""Standard deviation of a velocity where the filter starts, rad/s."""
_PASSES = 2
"""The first takes the mass matrix from the parameters that it begins with, the others from the result of the one before."""
_SHARE = 0.5
"""Standard deviation of a parameter that CAD does not know, as share of what would explain all torques of a joint alone."""


def kalman_filter(data: RegressionData, recorded: RecordedRows) -> Estimate:
    """χ̂ after two passes over all experiments, each from CAD with P0, and its covariance.

    The state is q, q̇ and χ over steps of 2 ms. With a the measured acceleration, q̈ = a + M⁻¹(τ − W(a) χ), which is the direct model and
    linear in χ but for M: the first pass takes that from what it begins with, the second from the first. P0 is 100 % of every CAD value;
    where CAD has none, half of what would explain all torques of a joint alone, and there rotor inertias, viscous and Coulomb friction
    begin. Q is the torque noise of `noise_levels`, white up to the band of the decimated rows; R is that of positions of 1e-5 rad;
    parameters do not wander. Square-root form by QR, the parameters scaled by P0. The message has the mean normalised innovation
    squared: above one, Q and R are too small. As a filter takes errors for independent, every standard deviation changes by what
    `batch_covariance` finds for it beside (WᵀW)⁻¹ at the same χ̂. Raises `FlexcalError` as `noise_levels` does, and where M is not
    positive definite.
    """
    noise = noise_levels(data)
    system = weighted_system(data, noise)
    unknowns = Unknowns.of(data, system)
    torque = np.reshape(noise, (len(recorded.experiments), -1))
    state = _Filter(data, unknowns, None)
    for _ in range(_PASSES):
        state = _Filter(data, unknowns, state.parameters)
        for sigma, experiment, window in zip(torque, recorded.experiments, recorded.windows, strict=True):
            for steps in forward_steps(recorded.observation, experiment, window, slowest_speeds(experiment)):
                if steps.begins:
                    state.restart()
                density = sigma**2 * recorded.decimation.factor * steps.spacing
                state.follow(steps, np.sqrt(density / steps.length))
    found, kept = state.parameters, unknowns.kept
    factor, scale = unknowns.reduced(system)
    root = scale[:, None] * np.linalg.solve(factor[:-1, :-1], np.eye(len(kept)))
    freedom = unknowns.freedom(system)
    cost = float(np.linalg.norm(system.right - system.matrix @ found) ** 2)
    spread = batch_covariance(data, noise, found, kept, root, cost / freedom)
    more = np.sqrt(np.diag(spread.covariance) / np.sum(root**2, axis=1))
    covariance = state.covariance() * np.outer(more, more)
    level = state.squares / max(1, state.count)
    message = f"extended Kalman filter; mean normalised innovation squared {level:.3g}, which should be 1"
    return unknowns.estimate(found, covariance, spread.freedom, cost, freedom, message, _PASSES)


class _Filter:
    """Estimates and the square root S of their covariance SᵀS, for q, q̇ and the scaled parameters."""

    def __init__(self, data: RegressionData, unknowns: Unknowns, about: np.ndarray | None) -> None:
        self._kept, self._n = unknowns.kept, data.observation.model.n
        self._model = data.observation.model
        self.parameters, prior = _prior(data, unknowns)
        self._about = self.parameters.copy() if about is None else about
        self._scale = np.sqrt(np.diag(prior))
        self._root = np.linalg.cholesky(prior / np.outer(self._scale, self._scale)).T
        self._state: np.ndarray | None = None
        self._whole = self._root
        self.squares, self.count = 0.0, 0

    def restart(self) -> None:
        """Forget the state of the robot, not its parameters."""
        if self._state is not None:
            self._root = triangular(self._whole[:, 2 * self._n :])
        self._state = None

    def covariance(self) -> np.ndarray:
        """(k, k) of the kept parameters."""
        self.restart()
        half = self._root * self._scale
        return half.T @ half

    def follow(self, steps: ForwardSteps, torque_noise: np.ndarray) -> None:
        """Predict and correct, step by step; `torque_noise` (n,) is the standard deviation of a step's mean torque, N m."""
        by_position, by_speed = steps.slopes(self._about)
        for k in range(len(steps.torque)):
            if steps.still[k]:
                self.restart()
                continue
            if self._state is None:
                self._start(steps.before[k], steps.speed[k])
            self._step(steps, k, by_position[k], by_speed[k], torque_noise)

    def _start(self, position: np.ndarray, speed: np.ndarray) -> None:
        n, size = self._n, 2 * self._n + len(self._kept)
        self._state = np.concatenate([position, speed])
        self._whole = np.zeros((size, size))
        self._whole[range(2 * n), range(2 * n)] = [POSITION_NOISE] * n + [_FIRST_SPEED] * n
        self._whole[2 * n :, 2 * n :] = self._root

    def _step(
        self,
        steps: ForwardSteps,
        k: int,
        by_position: np.ndarray,
        by_speed: np.ndarray,
        torque_noise: np.ndarray,
    ) -> None:
        assert self._state is not None
        n, h = self._n, steps.length
        q, dq = self._state[:n], self._state[n:]
        mass = steps.inertia[k] @ self._about
        if np.linalg.eigvalsh(mass)[0] <= 0:
            raise FlexcalError(
                f"the mass matrix of {self._model.path} is not positive definite with the filter's parameters; give CAD inertias and "
                "`drives: {rotor_inertia: […]}` nearer to the truth, or take --estimator wls."
            )
        moved = by_position @ (q + 0.5 * h * dq - steps.state[k, 0]) + by_speed @ (dq - steps.speed[k])
        push = np.linalg.inv(mass)
        torque = steps.torque[k] - moved
        felt = steps.columns[k]
        ddq = steps.middle.ddq[k] + push @ (torque - felt @ self.parameters)
        slope = np.hstack([-push @ by_position, -push @ by_speed, -push @ felt[:, self._kept] * self._scale])
        size = len(self._whole)
        onward = np.eye(size)
        onward[:n, n : 2 * n] = h * np.eye(n)
        onward[:n] += 0.5 * h**2 * slope
        onward[n : 2 * n] += h * slope
        noise = np.zeros((n, size))
        noise[:, :n], noise[:, n : 2 * n] = 0.5 * h**2 * (push * torque_noise).T, h * (push * torque_noise).T
        predicted = np.concatenate([q + h * dq + 0.5 * h**2 * ddq, dq + h * ddq])
        spread = np.vstack([self._whole @ onward.T, noise])
        table = np.zeros((n + len(spread), n + size))
        table[:n, :n] = POSITION_NOISE * np.eye(n)
        table[n:, :n], table[n:, n:] = spread[:, :n], spread
        factor = triangular(table)
        innovation = np.linalg.solve(factor[:n, :n].T, steps.after[k] - predicted[:n])
        change = factor[:n, n:].T @ innovation
        self._state = predicted + change[: 2 * n]
        self.parameters[self._kept] += self._scale * change[2 * n :]
        self._whole = factor[n:, n:]
        self.squares += float(innovation @ innovation)
        self.count += n


def _prior(data: RegressionData, unknowns: Unknowns) -> tuple[np.ndarray, np.ndarray]:
    """All parameters (p,) to begin with, and P0 (k, k) of the kept ones, with what the others may change of them."""
    values = data.observation.values()
    alone = np.full(len(values), np.inf)
    for s in data.subsystems:
        sizes = np.linalg.norm(s.triangle.matrix, axis=0)
        bound = np.linalg.norm(s.triangle.right) / np.where(sizes > 0, sizes, np.inf)
        alone[s.members] = np.where(sizes > 0, np.minimum(alone[s.members], bound), alone[s.members])
    alone = np.where(np.isfinite(alone), alone, 0.0)
    std = np.where(values != 0, np.abs(values), _SHARE * alone)
    keys = [name.rpartition(".")[2] for name in data.names]
    positive = np.array([key in ("rotor_inertia", "viscous", "coulomb") for key in keys]) & (values == 0)
    guess = np.where(positive, std, values)
    base = data.base.found
    rows = base.regrouping[[base.kept.index(number) for number in unknowns.kept]]
    start = values.copy()
    start[unknowns.kept] += rows @ (guess - values)
    return start, (rows * std**2) @ rows.T
