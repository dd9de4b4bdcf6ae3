"""Poses: position and rotation of a frame in another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Pose:
    """Position (3,), m, and rotation (3, 3) of a frame in another: a tool in the flange, a target in its work object."""

    position: np.ndarray
    rotation: np.ndarray

    @classmethod
    def identity(cls) -> Pose:
        """Pose of a frame in itself."""
        return cls(np.zeros(3), np.eye(3))

    def __matmul__(self, inner: Pose) -> Pose:
        """Pose of `inner`, which is given in this frame, where this one is given."""
        return Pose(self.position + self.rotation @ inner.position, self.rotation @ inner.rotation)

    def inverse(self) -> Pose:
        """Pose of the other frame in this one."""
        return Pose(-self.rotation.T @ self.position, self.rotation.T)

    def equals(self, other: Pose) -> bool:
        """Whether both are the same, number by number."""
        return np.array_equal(self.position, other.position) and np.array_equal(self.rotation, other.rotation)
