"""Rough shape of a robot whose URDF has no collision shapes: a capsule from joint to joint."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from flexcal.model.kinematics import (
    capsule_axes,
    joint_batch,
    link_frames,
    low_discrepancy_configurations,
    point_kinematics,
)
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import read_elements

_SAMPLES = 200
_MOSTLY = 0.25
"""Share of configurations in which capsules overlap, above which they are too thick to tell anything of these links."""
_BELOW = 1e-3
"""Depth, m, from which something is below the base plane."""
_BASE = -1


def has_collision_shapes(model: RobotModel) -> bool:
    """Whether the URDF of a robot has a collision shape."""
    return any(link.find("collision") is not None for link in read_elements(model.urdf).all("link"))


@dataclass(frozen=True, eq=False)
class RoughShape:
    """Capsules from joint to joint, which stand for links of unknown shape: a reason to look, never proof of a collision or of none.

    Links that a joint connects are not compared, nor those whose capsules overlap in more than a quarter of 200 configurations spread
    evenly over the joint ranges.

    Attributes
    ----------
    pairs : tuple of tuple of int
        Capsules that are compared, in the order of `capsule_axes`.
    """

    model: RobotModel
    pairs: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, model: RobotModel) -> RoughShape:
        """Rough shape of a robot."""
        parents = [joint.parent for joint in model.joints]
        owners = [owner for owner, _, _ in capsule_axes(model)]
        apart = tuple(
            (i, j)
            for i, j in combinations(range(len(owners)), 2)
            if owners[i] != owners[j] and not _connected(parents, owners[i], owners[j])
        )
        near = cls(model, apart)._overlap(low_discrepancy_configurations(model, _SAMPLES)).mean(axis=0)
        return cls(model, tuple(pair for pair, share in zip(apart, near, strict=True) if share <= _MOSTLY))

    def close(self, q: np.ndarray) -> list[tuple[tuple[str, str], ...]]:
        """Joints whose links are nearer than their capsules are thick, in pairs ('base' for what stands still), for each of q (N, n)."""
        owners = [owner for owner, _, _ in capsule_axes(self.model)]
        names = [(self._name(owners[i]), self._name(owners[j])) for i, j in self.pairs]
        return [
            tuple(dict.fromkeys(pair for pair, near in zip(names, row, strict=True) if near))
            for row in self._overlap(q)
        ]

    def _name(self, owner: int) -> str:
        return "base" if owner == _BASE else self.model.joint_names[owner]

    def _overlap(self, q: np.ndarray) -> np.ndarray:
        """Mask (N, pairs) of capsules that overlap."""
        q = joint_batch(self.model, q)
        axes = capsule_axes(self.model)
        if not self.pairs:
            return np.zeros((len(q), 0), bool)
        rotation, origin = link_frames(self.model, q)
        starts, ends = np.zeros((2, len(q), len(axes), 3))
        for k, (owner, end, _) in enumerate(axes):
            if owner != _BASE:
                starts[:, k] = origin[:, owner]
            ends[:, k] = starts[:, k] + (end if owner == _BASE else rotation[:, owner] @ end)
        first, second = np.array(self.pairs).T
        radius = np.array([radius for _, _, radius in axes])
        distance = _distances(starts[:, first], ends[:, first], starts[:, second], ends[:, second])
        return distance < radius[first] + radius[second]


def below_base(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Whether a joint's frame or the first point is below z = 0 of the base frame (N,), in each of q (N, n)."""
    q = joint_batch(model, q)
    lowest = link_frames(model, q)[1][:, :, 2].min(axis=1)
    if model.points:
        lowest = np.minimum(lowest, point_kinematics(model, q, jacobians=False).position[:, 2])
    return lowest < -_BELOW


def _connected(parents: list[int], one: int, other: int) -> bool:
    return (other != _BASE and parents[other] == one) or (one != _BASE and parents[one] == other)


def _distances(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Distances (…) of the line segments from a to b and from c to d (…, 3), none of them a point."""
    u, v, w = b - a, d - c, a - c
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    uw, vw = (u * w).sum(-1), (v * w).sum(-1)
    across = uu * vv - uv**2
    parallel = across < 1e-12 * uu * vv
    s = np.where(parallel, 0.0, (uv * vw - vv * uw) / np.where(parallel, 1.0, across)).clip(0.0, 1.0)
    t = ((uv * s + vw) / vv).clip(0.0, 1.0)
    s = ((uv * t - uw) / uu).clip(0.0, 1.0)
    return np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)
