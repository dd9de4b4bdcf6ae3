"""Base columns of joint torques along a motion, their information, and its derivatives by the motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.estimation import Identifiability, analyse
from flexcal.model.robot import Links, RobotModel, carried_inertias
from flexcal.model.torques import (
    inertial_names,
    inertial_parameters,
    placed_regressor_adjoint,
    torque_regressor,
    write_torque_regressor,
)

DRIVE = ("rotor_inertia", "viscous", "coulomb", "torque_offset")
"""Columns of every drive: acceleration, velocity, its sign, one."""
REVERSAL = 0.02
"""Share of a joint's velocity limit below which the sign of the velocity is smoothed, so that it has a derivative."""
_SAMPLES_PER_COLUMN = 3
_SEED = 1991


@dataclass(frozen=True, eq=False)
class BaseRegressor:
    """Base columns of the observation matrix of a rigid robot with classic friction (Eq. 2.20; Gautier 1991).

    `payload` is what the robot holds, kg; None takes the declared one. `identifiability` says which of all columns (`names`) are kept and
    what the others add to them.
    """

    model: RobotModel
    payload: float | None
    identifiability: Identifiability

    @classmethod
    def of(cls, model: RobotModel, payload: float | None = None) -> BaseRegressor:
        """Base columns by rank-revealing QR at random states, the same in every run."""
        names = column_names(model)
        samples = _SAMPLES_PER_COLUMN * len(names)
        rng = np.random.default_rng(_SEED)
        q = rng.uniform(-np.pi, np.pi, (samples, model.n))
        dq, ddq = rng.uniform(-2.0, 2.0, (2, samples, model.n))
        matrix = np.zeros((model.n, samples, len(names)))
        links = 10 * model.n
        matrix[:, :, :links] = torque_regressor(model, q, dq, ddq).transpose(1, 0, 2)
        for joint in range(model.n):
            own = np.array([ddq[:, joint], dq[:, joint], np.sign(dq[:, joint]), np.ones(samples)]).T
            matrix[joint][:, links + joint :: model.n] = own
        stacked = matrix.reshape(-1, len(names))
        norms = np.linalg.norm(stacked, axis=0)
        kinds = [name.rpartition(".")[2].rstrip("xyz") for name in names]
        largest = {kind: max(n for k, n in zip(kinds, norms, strict=True) if k == kind) for kind in kinds}
        scale = np.array([1 / (largest[kind] or 1.0) for kind in kinds])
        prefer = [f"{joint.link}.{key}" for joint in model.joints for key in _KEPT_FIRST]
        prefer += [name for name in names if name not in set(prefer)]
        return cls(model, payload, analyse(stacked, names, scale=scale, prefer=prefer))

    @property
    def rank(self) -> int:
        """Number of base parameters."""
        return self.identifiability.rank

    @cached_property
    def values(self) -> np.ndarray:
        """Model values of all columns (p,), unknown friction zero."""
        bodies = carried_inertias(self.model, self.payload)
        loaded = replace(self.model, links=Links.of(bodies))
        own = self.model.drives
        drives = np.concatenate([own.rotor_inertia, own.viscous, own.coulomb, own.torque_offset])
        return np.concatenate([inertial_parameters(loaded), np.nan_to_num(drives)])

    @cached_property
    def base_values(self) -> np.ndarray:
        """Values of the base columns (r,)."""
        return self.identifiability.regrouping @ self.values

    @cached_property
    def smooth_values(self) -> np.ndarray:
        """Values of the base columns (r,) that make the torque without Coulomb friction."""
        values = self.values.copy()
        coulomb = [name.endswith(".coulomb") for name in self.identifiability.names]
        values[coulomb] = 0.0
        return self.identifiability.regrouping @ values

    @cached_property
    def _places(self) -> np.ndarray:
        """Row numbers (n, 10 n) of the links' columns below the joints' columns, -1 for those left out."""
        places = np.full((self.model.n, 10 * self.model.n), -1)
        for row, column in enumerate(self.identifiability.kept):
            if column < places.shape[1]:
                places[:, column] = self.rank * np.arange(self.model.n) + row
        return places

    @cached_property
    def _drives(self) -> tuple[tuple[int, int, int], ...]:
        """Row, joint and kind of every kept drive column."""
        links = 10 * self.model.n
        return tuple(
            (row, (column - links) % self.model.n, (column - links) // self.model.n)
            for row, column in enumerate(self.identifiability.kept)
            if column >= links
        )

    @cached_property
    def _reversal(self) -> np.ndarray:
        fastest = np.array([joint.velocity for joint in self.model.joints])
        return REVERSAL * np.where(np.isfinite(fastest), fastest, 1.0)

    def write(self, motion: np.ndarray) -> np.ndarray:
        """Columns (n, r, N) of every joint's torque, N m, along q, q̇, q̈ (3, N, n)."""
        q, dq, ddq = motion
        columns = np.zeros((self.model.n, self.rank, len(q)))
        write_torque_regressor(self.model, q, dq, ddq, self._places, columns.reshape(-1, len(q)))
        for row, joint, kind in self._drives:
            columns[joint, row] = (
                ddq[:, joint],
                dq[:, joint],
                np.tanh(dq[:, joint] / self._reversal[joint]),
                1.0,
            )[kind]
        return columns

    def by_motion(self, motion: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        """∂f/∂q, ∂f/∂q̇, ∂f/∂q̈ (3, N, n) of any f of the columns from `slopes` = ∂f/∂columns (n, r, N)."""
        q, dq, ddq = motion
        rows = slopes.reshape(-1, len(q))
        derivatives = np.array(placed_regressor_adjoint(self.model, q, dq, ddq, self._places, rows))
        for row, joint, kind in self._drives:
            if kind == 0:
                derivatives[2, :, joint] += slopes[joint, row]
            elif kind == 1:
                derivatives[1, :, joint] += slopes[joint, row]
            elif kind == 2:
                width = self._reversal[joint]
                derivatives[1, :, joint] += slopes[joint, row] / (width * np.cosh(dq[:, joint] / width) ** 2)
        return derivatives


_KEPT_FIRST = ("Izz", "Ixx", "Ixy", "Ixz", "Iyz", "Iyy", "mc_x", "mc_y", "mc_z", "mass")
"""Order in which parameters of a link are preferably kept: mass and entries along the axis are regrouped first."""


def column_names(model: RobotModel) -> tuple[str, ...]:
    """Links' inertials in chain order, then rotor inertias, viscous and Coulomb friction and torque offsets of all joints."""
    return (*inertial_names(model), *(f"{joint}.{key}" for key in DRIVE for joint in model.joint_names))
