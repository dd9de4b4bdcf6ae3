"""Torque equations of a robot with and without payload, W χ + W_p φ = Y, with a prior of χ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.dynamics.payload.flexibility_correction import YIELD, error_column
from flexcal.dynamics.payload.robot_prior import FRICTION, RobotPrior
from flexcal.dynamics.regression import Batch, RegressionData, triangular
from flexcal.model.parts import LINK_PARAMETERS, PSEUDO_INERTIA, Payload

FRICTION_CHANGE = 0.2
"""Relative 1σ of the change of Coulomb and viscous friction between recordings, by warm-up and load; and of a torque offset, relative to
the Coulomb friction of its joint.
"""


@dataclass(frozen=True, eq=False)
class PayloadEquations:
    """Equations of several recordings; `loaded` (one each) tells whether the payload `attached` is held.

    Unknown are y and z of the `prior`, what friction is beyond the robot's own in the loaded recordings, and the payload's ten
    parameters φ in its frame, in this order. `data` are equations of links and drives, with the columns of an `FlexibilityCorrection` each.
    """

    data: RegressionData
    loaded: Sequence[bool]
    attached: Payload
    prior: RobotPrior

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all unknowns."""
        open_, known = self.prior.free.shape[1], self.prior.base_root.shape[1]
        return (
            *(f"open_{k}" for k in range(open_)),
            *(f"known_{k}" for k in range(known)),
            *(f"{name}.change" for name in self._rubbing),
            *(f"payload.{key}" for key in LINK_PARAMETERS),
        )

    @property
    def payload(self) -> slice:
        """Indices of the payload's ten parameters among the unknowns."""
        return slice(len(self.names) - len(LINK_PARAMETERS), len(self.names))

    @cached_property
    def _rubbing(self) -> tuple[str, ...]:
        """Names of friction parameters that may change."""
        return tuple(name for name in self.data.names if name.rpartition(".")[2] in FRICTION)

    def prior_rows(self) -> np.ndarray:
        """Whitened rows (k, unknowns) of the prior."""
        first = self.prior.free.shape[1]
        width = self.prior.base_root.shape[1]
        rows = np.eye(len(self.names))[first : first + width]
        values = self.data.observation.model.values
        changes = []
        for number, name in enumerate(self._rubbing):
            joint, _, key = name.rpartition(".")
            size = abs(np.nan_to_num(values[f"{joint}.coulomb" if key == "torque_offset" else name]))
            if size > 0:
                changes.append(np.eye(len(self.names))[first + width + number] / (FRICTION_CHANGE * size))
        return np.vstack([rows, *changes])

    @cached_property
    def batches(self) -> list[list[Batch]]:
        """Equations of every recording, in consecutive parts, for these unknowns."""
        joints = range(self.data.observation.model.n)
        maps = {loaded: [self._map(joint, loaded) for joint in joints] for loaded in set(self.loaded)}
        return [
            [
                replace(batch, factors=tuple(f @ m for f, m in zip(batch.factors, maps[loaded], strict=True)))
                for batch in own
            ]
            for own, loaded in zip(self.data.batches, self.loaded, strict=True)
        ]

    def system(self, noise: Sequence[float]) -> np.ndarray:
        """Factor R (unknowns + 1, ·) of all equations, each divided by its `noise` (N m, joints of one recording after the other)."""
        n, stack = self.data.observation.model.n, []
        for number, own in enumerate(self.batches):
            for joint in range(n):
                rows = np.vstack([batch.factors[joint] for batch in own])
                stack.append(triangular(rows / noise[number * n + joint]))
        return triangular(np.vstack(stack))

    def coefficients(self, unknowns: np.ndarray, loaded: bool) -> np.ndarray:
        """Coefficients χ (p,) of all columns of `data` for which W χ are the torques predicted by `unknowns` (u,), with or without
        payload.
        """
        missed = np.append(-unknowns, 1.0)
        parameters = np.zeros(len(self.data.names))
        for joint, column_indices in enumerate(self.data.observation.column_indices):
            parameters[column_indices] = -(self._map(joint, loaded) @ missed)[:-1]
        return parameters

    def _map(self, joint: int, loaded: bool) -> np.ndarray:
        """Matrix (m + 1, unknowns + 1) from a joint's [W, Y] to its equations."""
        names, column_indices = self.data.names, self.data.observation.column_indices[joint]
        base = {number: row for row, number in enumerate(self.data.base.identifiability.kept)}
        result = np.zeros((len(column_indices) + 1, len(self.names) + 1))
        first = self.prior.free.shape[1]
        known = slice(first, first + self.prior.base_root.shape[1])
        changes = {name: known.stop + number for number, name in enumerate(self._rubbing)}
        errors = dict(zip(map(error_column, self.prior.sources), self.prior.source_root, strict=True))
        moved, link = payload_to_link_frame(self.attached), len(LINK_PARAMETERS) * self.attached.joint
        result[-1, -1] = 1.0
        for row, number in zip(result, column_indices, strict=False):
            name = names[number]
            if name == YIELD:
                row[-1] = -1.0
            elif name in errors:
                row[known] = errors[name]
            elif number in base:
                row[:first] = self.prior.free[base[number]]
                row[known] = self.prior.base_root[base[number]]
                row[-1] = -self.prior.base[base[number]]
            if loaded and name in changes:
                row[changes[name]] = 1.0
            if loaded and 0 <= number - link < len(LINK_PARAMETERS):
                row[self.payload] = moved[number - link]
        return result


def payload_to_link_frame(payload: Payload) -> np.ndarray:
    """Matrix (10, 10) from a body's ten parameters in the payload's frame to those in the frame of its link."""
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = payload.rotation, payload.translation
    moved = place @ PSEUDO_INERTIA @ place.T
    basis = PSEUDO_INERTIA.reshape(len(LINK_PARAMETERS), -1)
    return np.linalg.lstsq(basis.T, moved.reshape(len(LINK_PARAMETERS), -1).T, rcond=None)[0]
