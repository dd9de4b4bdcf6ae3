"""Joints without a motor of their own: they follow other joints by linear relations, or by loops that close."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from flexcal.model.parts.joint import Joint
from flexcal.model.parts.tree import path_to

LOOP = ("a_x", "a_y", "a_z", "b_x", "b_y", "b_z")
"""Displacements of the frames a and b of a loop in their links, along their own axes, m."""


_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class LoopEnd:
    """Frame of a loop at `rotation` (3, 3), `translation` (3,) in the link of joint `joint`; -1 is the base."""

    joint: int
    rotation: np.ndarray
    translation: np.ndarray


@dataclass(frozen=True, eq=False)
class Loop:
    """Two frames `a` and `b` that coincide, which determines the joints `passive`.

    `ground`: joint whose link carries both branches, -1 for the base; `around`: joints of both branches. `rows` (k, 3): directions in that
    link along which the frames meet, those normal to the axis of a pin, or all three. `start` (k,): roughly the passive positions with the
    motors at rest. `errors`: those out of `LOOP` that count, of frames on links that carry more, so that no length of the link's is theirs.
    """

    name: str
    a: LoopEnd
    b: LoopEnd
    ground: int
    around: tuple[int, ...]
    passive: tuple[int, ...]
    rows: np.ndarray
    start: np.ndarray
    errors: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Relations:
    """How the actual positions of N joints, deflection included, follow from n motors.

    θ = C (D q + s + S p + e) with the motors' positions q, deviations e of every joint from its own motor or relation, and the positions p
    of the joints that loops determine. `motors` (n,): indices of the joints with motors. `by_motor` D (N, n); `carry` C (N, N), which has a
    unit diagonal; `shift` s (N,); `loops`; `closed`: the nominal positions of all joints at the motor positions last asked for.
    """

    motors: tuple[int, ...]
    by_motor: np.ndarray
    carry: np.ndarray
    shift: np.ndarray
    loops: tuple[Loop, ...]
    closed: dict[bytes, np.ndarray] = field(default_factory=dict)

    @property
    def closing(self) -> tuple[int, ...]:
        """Joints on whose own motion it depends how the loops close."""
        around = [joint for loop in self.loops for joint in loop.around]
        return tuple(np.flatnonzero(self.carry[around].any(axis=0)).tolist())

    @property
    def ratios(self) -> np.ndarray:
        """Ratios R (N, N) of every joint to those that it follows, C = (I - R)⁻¹."""
        direct = np.eye(len(self.carry)) - np.linalg.inv(self.carry)
        return np.where(np.abs(direct) > _ROUNDING, direct, 0.0)

    @property
    def passive(self) -> tuple[int, ...]:
        """Joints that loops determine."""
        return tuple(joint for loop in self.loops for joint in loop.passive)

    def linear(self, q: np.ndarray) -> np.ndarray:
        """Positions (samples, N) of all joints at the motors' `q` (samples, n), those that loops determine being zero."""
        return (q @ self.by_motor.T + self.shift) @ self.carry.T


def carried(ratios: Mapping[int, Mapping[int, float]], joints: int) -> np.ndarray | None:
    """Matrix C (N, N) = (I - R)⁻¹ of the ratios R by joint and the joint that it follows; None where a joint follows itself in a circle."""
    direct = np.zeros((joints, joints))
    for joint, of in ratios.items():
        for other, ratio in of.items():
            direct[joint, other] = ratio
    reach = np.linalg.matrix_power((direct != 0).astype(float) + np.eye(joints), joints) > 0
    if (reach & reach.T & ~np.eye(joints, dtype=bool)).any():
        return None
    carry, power = np.eye(joints), np.eye(joints)
    for _ in range(joints):
        power = power @ direct
        carry = carry + power
    return carry


def joints_that_move(joints: Sequence[Joint], relations: Relations | None, joint: int) -> tuple[int, ...]:
    """Indices of the joints that move a joint's link: those from the base to it, and those that these follow."""
    moving = set(path_to(joints, joint))
    if relations is None:
        return tuple(sorted(moving))
    while True:
        further = {int(j) for i in moving for j in np.flatnonzero(relations.carry[i])}
        for loop in relations.loops:
            if moving & set(loop.passive):
                further |= {*loop.around}
        if further <= moving:
            return tuple(sorted(moving))
        moving |= further


def common_joint(one: Sequence[int], other: Sequence[int]) -> int:
    """Last joint of two paths from the base that is in both; -1 where they part at the base."""
    shared = [i for i, j in zip(one, other, strict=False) if i == j]
    return shared[-1] if shared else -1
