"""Simulated robot under its position controller, step by step."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.simulation.rigid_robot import RigidRobotSimulator
from flexcal.errors import FlexcalError

_STEP = 1.0
"""Longest step of the simulation, relative to 1/ω of an unknown controller's loop or the period of a declared one."""
_LOST = 1.0
"""Distance from the path, rad or m, beyond which the simulated robot does not follow it."""


@dataclass(frozen=True, eq=False)
class LoopReference:
    """Reference of the loop at an instant: path, its derivatives, and the feed-forward torque, each (n,).

    That is what acts from outside and, with a declared controller, the torque given beforehand.
    """

    time: float
    path: np.ndarray
    speed: np.ndarray
    push: np.ndarray
    torque: np.ndarray

    def until(self, later: LoopReference, share: float) -> LoopReference:
        """References on the way to a later one."""
        span, left = later.time - self.time, 1.0 - share
        push = left * self.push + share * later.push
        bend = 0.5 * span**2 * share * left * push
        return LoopReference(
            self.time + share * span,
            left * self.path + share * later.path - bend,
            left * self.speed + share * later.speed,
            push,
            left * self.torque + share * later.torque,
        )


class ClosedLoop:
    """Closed loop with torque u + kp e + kd ė, e the path less the motion, by linearly implicit Euler steps: stable for any gains.

    With the controller that robot.yaml declares u is the torque that is given: the measured one makes this the controller with the
    command r that it must have had, kp (r - q) + kd (ṙ - q̇) = u. Without, u is what acts from outside alone, and the gains are those
    of a critically damped loop of `natural` frequency (rad/s) for the inertia that each joint has at the moment. `step` (s) lies between
    targets.
    """

    def __init__(self, robot: RigidRobotSimulator, step: float, natural: float) -> None:
        self._robot, self._natural = robot, natural
        self._declared = robot.model.controller
        fastest = natural if self._declared is None else self._declared.rate_hz
        self._parts = max(1, math.ceil(step * fastest / _STEP - 1e-9))
        self._step = step / self._parts
        self._q = self._dq = self._ddq = np.zeros(0)
        self._last: LoopReference | None = None

    def reach(self, target: LoopReference) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State q, q̇ and q̈ (n,) at the time of a target, `step` after that of the last one.

        Raises `FlexcalError` where the mass matrix is not positive definite or the robot leaves the path.
        """
        if self._last is None:
            self._q, self._dq, self._ddq = target.path, target.speed, target.push
        else:
            for part in range(1, self._parts):
                self._advance(self._last.until(target, part / self._parts))
        self._last = target
        q, dq = self._q, self._dq
        self._advance(target)
        if not np.abs(target.path - q).max() < _LOST:
            raise FlexcalError(
                "E-DYN-042",
                f"{self._robot.name}: the simulated robot does not follow the recorded path at {target.time:.6g} s; check `controller:` "
                "in robot.yaml, or use --estimator wls.",
            )
        return q, dq, self._ddq

    def _advance(self, target: LoopReference) -> None:
        mass, h = self._robot.mass_matrix(self._q), self._step
        error, slip = target.path - self._q, target.speed - self._dq
        if self._declared is None:
            own = np.diag(mass)
            kp, kd = self._natural**2 * own, 2 * self._natural * own
        else:
            kp, kd = np.array(self._declared.kp), np.array(self._declared.kd)
        missing = target.torque + kp * (error + h * slip) + kd * slip
        missing -= self._robot.torque(target.time, self._q, self._dq, target.push, self._ddq)
        self._ddq = target.push + np.linalg.solve(mass + np.diag(h * kd + h * h * kp), missing)
        self._q = self._q + h * (self._dq + 0.5 * h * self._ddq)
        self._dq = self._dq + h * self._ddq
