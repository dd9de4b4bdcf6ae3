"""Rigid robot with its drives, ready for simulation."""

from __future__ import annotations

import numpy as np

from flexcal.dynamics.inverse_model import Memory, Observation
from flexcal.dynamics.signals import Motion
from flexcal.errors import FlexcalError
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.vibration import ElasticArm

_PINOCCHIO = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]
"""Pinocchio's order of the ten parameters, with Iyy before Ixz; it also accepts nonphysical ones."""


class RigidRobotSimulator:
    """Mass matrix and torques for `parameters` (p,) of an observation: links in Pinocchio, drives by their terms.

    Springs do not yield in it. `name` is what messages call the experiment; terms with a memory take it for one that goes on.
    """

    def __init__(self, observation: Observation, parameters: np.ndarray, name: str) -> None:
        import pinocchio as pin

        self.model, self.name = observation.model, name
        links = len(LINK_PARAMETERS) * self.model.n
        rigid = self.model.without_springs()
        self._arm = ElasticArm(rigid, 0.0)
        for body, turn, own in zip(
            self._arm.bodies,
            self._arm.turns,
            parameters[:links].reshape(-1, len(LINK_PARAMETERS)),
            strict=True,
        ):
            link = pin.Inertia.FromDynamicParameters(own[_PINOCCHIO])
            self._arm.model.inertias[body] = pin.SE3(turn.T, np.zeros(3)).act(link)
        self._terms = observation.terms
        self._values = dict(zip(observation.names, parameters, strict=True))
        self._memory: Memory = {}
        rest = np.zeros(self.model.n)
        at_rest = self._drive(0.0, rest, rest, rest, {})
        pushed = [self._drive(0.0, rest, rest, push, {}) - at_rest for push in np.eye(self.model.n)]
        self.rotors = np.array(pushed).T
        self._below = np.tril_indices(self.model.n, -1)

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """Mass matrix (n, n) of links and drives; raises `FlexcalError` if it is not positive definite."""
        import pinocchio as pin
        from scipy.linalg.lapack import dpotrf  # pyright: ignore[reportAttributeAccessIssue]

        mass = pin.crba(self._arm.model, self._arm.data, self._at(q))  # its upper triangle
        mass[self._below] = mass.T[self._below]
        mass = mass + self.rotors
        if dpotrf(mass)[1] != 0:
            raise FlexcalError(
                "E-DYN-043",
                f"the estimate gives the robot a mass matrix that is not positive definite at q = {np.array2string(q, precision=3)} of "
                f"{self.name}, so it cannot be simulated; use --estimator sdp, or record a motion that excites more.",
            )
        return mass

    def torque(
        self, time: float, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, before: np.ndarray
    ) -> np.ndarray:
        """Torque (n,) of links and drives; load-dependent friction uses the acceleration `before`."""
        import pinocchio as pin

        links = pin.rnea(self._arm.model, self._arm.data, self._at(q), dq, ddq)
        return links + self._drive(time, q, dq, before, self._memory) + self.rotors @ (ddq - before)

    def _at(self, q: np.ndarray) -> np.ndarray:
        return q + self.model.geometry.errors[:, 0]

    def _drive(
        self, time: float, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, memory: Memory
    ) -> np.ndarray:
        at = Motion(np.array([time]), q[None], dq[None], ddq[None], q[None])
        torque = np.zeros(len(q))
        for term in self._terms:
            for column in term.columns(self.model, at, memory):
                torque[column.joint] += self._values[column.name] * column.values[0]
        return torque
