"""Newton's method for the command that brings the real tool to its target, on the calibrated robot and the flank set by gravity."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from flexcal.compensation.inverse_kinematics import NEAR, nearest_positions
from flexcal.compensation.tool_target import ToolPoseTarget
from flexcal.model.kinematics import damped_step, joint_limits
from flexcal.model.robot import RobotModel
from flexcal.model.statics import ToolAtRest, tool_at_rest

LARGEST_CORRECTION = 0.2
"""Largest difference of a command from the nominal one (rad or m, any joint); beyond it the posture is another one."""
_ITERATIONS = 12
_SHARED = 4
"""Number of steps that share the Jacobian of the nominal command; later steps have their own."""
_DAMPING = 1e-7
"""Damping relative to the reach: keeps exactly singular rows solvable, and is far below what can be corrected."""


_PER_ROW = (
    "nominal",
    "payload",
    "temperature",
    "q",
    "origin",
    "at_limit",
    "reached",
    "turned",
    "flank",
    "torque",
    "jacobian",
    "before",
    "after",
)


class CommandSearch:
    """Commands of least change from `nominal` (N, n) that bring the deflected robot to `aim`, carrying `payload` (N,) kg at
    `temperature` (N,), °C.

    q ← q₀ + J⁺ (r + J (q − q₀)), the Gauss-Newton step to the solution nearest to q₀; for six joints and a full pose it is Newton's.
    A correction of millimetres hardly turns J, so that the first one serves for four steps.
    How the arm stands with the tool at its aim does not depend on the flank, and so the torque there settles it: once the steps have come
    to an end, and not on the way, where it could turn to and fro. Where a redundant arm leaves a limit, that joint is held there and the
    others make up for it. Rows in which these steps lead away are `lost`, and sought once more by `try_damped`. Raises `FlexcalError`
    where the springs cannot carry the arm.

    Attributes
    ----------
    q : ndarray
        Motor positions (N, n) after the last step.
    reached : ndarray
        Mask (N,): the tool is at its target, within all limits.
    before, after : ndarray
        Aim minus tool (N, m), as `ToolPoseTarget.residual` has it, at the nominal command and at `q`.
    torque : ndarray
        N m at rest (N, n).
    """

    def __init__(
        self,
        model: RobotModel,
        aim: ToolPoseTarget,
        nominal: np.ndarray,
        payload: np.ndarray | None,
        temperature: np.ndarray | None,
    ) -> None:
        self.model, self.aim, self.nominal = model, aim, nominal
        self.payload, self.temperature = payload, temperature
        self.lower, self.upper = joint_limits(model)
        self.weight = aim.weight(model)
        self.rows = np.arange(len(nominal))
        self.q, self.origin = nominal.copy(), nominal.copy()
        self.at_limit = np.zeros(nominal.shape, dtype=bool)
        self.reached, self.turned = np.zeros((2, len(nominal)), dtype=bool)
        start = self._at_rest(self.rows, nominal, None, jacobians=True)
        self.flank, self.torque = start.rest.flank, start.rest.torque
        self.jacobian = aim.own_rows(start.command_jacobian())
        self.before = aim.residual(start.kinematics)
        self.after = self.before.copy()

    def subset(self, rows: np.ndarray) -> CommandSearch:
        """Rows with these indices or of this mask."""
        own = copy(self)
        own.aim = self.aim.subset(rows)
        for name in _PER_ROW:
            values = getattr(self, name)
            setattr(own, name, None if values is None else values[rows])
        own.rows = np.arange(len(own.q))
        return own

    def joined(self, others: Sequence[CommandSearch]) -> CommandSearch:
        """Rows of this search and then those of others for the same robot."""
        every = [self, *others]
        own = copy(self)
        own.aim = self.aim.joined([other.aim for other in others])
        for name in _PER_ROW:
            values = [getattr(one, name) for one in every]
            setattr(own, name, None if values[0] is None else np.concatenate(values))
        own.rows = np.arange(len(own.q))
        return own

    @property
    def lost(self) -> np.ndarray:
        """Mask (N,) of rows that the steps did not bring to their aim."""
        return ~self.reached & ~self.aim.reached(self.after)

    def step(self) -> None:
        """Take the Newton steps."""
        for iteration in range(_ITERATIONS):
            if not len(self.rows):
                break
            self._advance(jacobians=iteration >= _SHARED - 1)

    def _advance(self, *, jacobians: bool) -> None:
        """One step of all active rows; converged and diverging ones are removed."""
        self._step(self.rows)
        rows = self.rows = self.rows[~self._far(self.rows)]
        self._evaluate(rows, self.q[rows], jacobians=jacobians)
        there = self.aim.reached(self.after[rows])
        goes_on = ~there
        goes_on[there] = self._turn_flanks(rows[there]) | self._hold_at_limits(rows[there])
        self.rows = rows[goes_on]

    def try_damped(self) -> None:
        """Repeat rows without result by damped least squares within the limits; twice if the flank changes at the end."""
        rows = np.flatnonzero(self.lost)

        def forward(own: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            self._evaluate(rows[own], q, jacobians=True)
            return self.after[rows[own]], self.jacobian[rows[own]]

        for _ in range(2):
            aim = self.aim.subset(rows)
            self.q[rows], self.after[rows] = nearest_positions(
                self.model, aim, self.nominal[rows], NEAR, forward
            )
            there = rows[self.aim.reached(self.after[rows])]
            self._evaluate(there, self.q[there], jacobians=False)
            turns = self._turn_flanks(there)
            self.reached[there] = ~turns & ~self._far(there)
            rows = there[turns]

    def _at_rest(
        self, rows: np.ndarray, q: np.ndarray, flank: np.ndarray | None, *, jacobians: bool
    ) -> ToolAtRest:
        payload, warm = (None if own is None else own[rows] for own in (self.payload, self.temperature))
        target = self.aim.target[rows]
        return tool_at_rest(
            self.model,
            q,
            payload,
            target,
            flank=flank,
            jacobians=jacobians,
            parameters=False,
            temperature=warm,
        )

    def _evaluate(self, rows: np.ndarray, q: np.ndarray, *, jacobians: bool) -> None:
        """Residuals and torques of rows at `q` (k, n) on their flanks, and, with `jacobians`, their Jacobians."""
        at = self._at_rest(rows, q, self.flank[rows], jacobians=jacobians)
        self.torque[rows] = at.rest.torque
        self.after[rows] = self.aim.subset(rows).residual(at.kinematics)
        if jacobians:
            self.jacobian[rows] = self.aim.subset(rows).own_rows(at.command_jacobian())

    def _far(self, rows: np.ndarray) -> np.ndarray:
        correction = np.abs(self.q[rows] - self.nominal[rows])
        return correction.max(axis=1, initial=0.0) > LARGEST_CORRECTION

    def _turn_flanks(self, rows: np.ndarray) -> np.ndarray:
        """Set the flanks of converged arms by the sign of their torques, once; mask (k,) of those that changed."""
        flank = np.sign(self.torque[rows]) * np.abs(self.flank[rows])
        turns = (flank != self.flank[rows]).any(axis=1) & ~self.turned[rows]
        self.flank[rows[turns]] = flank[turns]
        self.turned[rows[turns]] = True
        self._evaluate(rows[turns], self.q[rows[turns]], jacobians=False)
        return turns

    def _hold_at_limits(self, rows: np.ndarray) -> np.ndarray:
        """Mark arms within limits as reached; hold the joint farthest beyond its limit if enough others are free; mask (k,) of those."""
        beyond = np.maximum(self.lower - self.q[rows], self.q[rows] - self.upper)
        outside = (beyond > 0).any(axis=1)
        self.reached[rows] = ~outside & self.aim.reached(self.after[rows])
        moves = ~self.at_limit[rows] & (self.jacobian[rows] != 0).any(axis=1)
        spare = outside & (moves.sum(axis=1) > self.aim.rows)
        joint = np.argmax(beyond[spare], axis=1)
        rows_held = rows[spare]
        self.at_limit[rows_held, joint] = True
        self.origin[rows_held, joint] = np.clip(
            self.q[rows_held, joint], self.lower[joint], self.upper[joint]
        )
        return spare

    def _step(self, rows: np.ndarray) -> None:
        """Gauss-Newton step from the origin, without the held joints."""
        jacobian = self.jacobian[rows]
        moved = self.q[rows] - self.origin[rows]
        residual = (self.after[rows] + np.matmul(jacobian, moved[:, :, None])[:, :, 0]) * self.weight
        free = np.where(self.at_limit[rows][:, None, :], 0.0, jacobian * self.weight[:, None])
        self.q[rows] = self.origin[rows] + damped_step(free, residual, _DAMPING * self.model.reach)
