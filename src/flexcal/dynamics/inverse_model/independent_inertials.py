"""Independent inertial columns of each joint, which reproduce all others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from flexcal.estimation import analyse
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.robot import RobotModel
from flexcal.model.torques import inertial_names, torque_regressor

_SEED = 1991
_SAMPLES_PER_COLUMN = 3


@dataclass(frozen=True, eq=False)
class InertialColumns:
    """Inertial columns of one joint: of those that act on it, `felt` (f,), the independent ones `kept` (k,): W = W_kept · `projection`
    (k, f).

    That holds at every state, to the 1e-9 of the largest column that rank is counted by.
    """

    felt: np.ndarray
    kept: np.ndarray
    projection: np.ndarray


@lru_cache(maxsize=4)
def inertial_columns(model: RobotModel) -> tuple[InertialColumns, ...]:
    """Independent columns of every joint, by rank-revealing QR of its columns at random states."""
    names = inertial_names(model)
    q, dq, ddq = random_states(model, _SAMPLES_PER_COLUMN * len(names))
    matrix = torque_regressor(model, q, dq, ddq)
    scale = scale_by_kind(matrix.transpose(1, 0, 2).reshape(-1, len(names)), names)
    joints = []
    for joint in range(model.n):
        felt = np.array([number for number in range(len(names)) if _beyond(model, joint, number)])
        seen = analyse(matrix[:, joint, felt], [names[number] for number in felt], scale=scale[felt])
        joints.append(InertialColumns(felt, felt[list(seen.kept)], seen.regrouping))
    return tuple(joints)


def _beyond(model: RobotModel, joint: int, column: int) -> bool:
    return joint in model.path_to(column // len(LINK_PARAMETERS))


def random_states(model: RobotModel, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random positions, velocities and accelerations (samples, n), independent of each other, the same in every run."""
    rng = np.random.default_rng(_SEED)
    q = rng.uniform(-np.pi, np.pi, (samples, model.n))
    dq, ddq = rng.uniform(-2.0, 2.0, (2, samples, model.n))
    return q, dq, ddq


def scale_by_kind(matrix: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Common scale of all parameters of a kind, which leaves columns that are only rounding of the URDF small."""
    kinds = [name.rpartition(".")[2].rstrip("xyz") for name in names]
    norms = np.linalg.norm(matrix, axis=0)
    largest = {kind: max(n for k, n in zip(kinds, norms, strict=True) if k == kind) for kind in set(kinds)}
    return np.array([1.0 / (largest[kind] or 1.0) for kind in kinds])
