"""Representations of an orientation by numbers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flexcal.model.parts import (
    rotation_rpy,
    rotation_vector,
    rotation_wxyz,
    rpy_rotation,
    vector_rotation,
    wxyz_rotation,
)


class Orientation(ABC):
    """How a dialect writes an orientation, by `count` numbers."""

    count: ClassVar[int] = 3

    def is_valid(self, numbers: Sequence[float]) -> bool:
        """Whether numbers of usual size stand for an orientation."""
        return True

    @abstractmethod
    def rotation(self, numbers: Sequence[float], angle: float) -> np.ndarray:
        """Rotation (3, 3) of the numbers; `angle` is the dialect's unit of angles, rad."""

    @abstractmethod
    def numbers(self, rotation: np.ndarray, old: Sequence[float], angle: float) -> tuple[float, ...]:
        """Numbers of a rotation; of several that mean the same, those nearest to `old`."""


@dataclass(frozen=True)
class RotationVector(Orientation):
    """Axis times angle (Universal Robots)."""

    def rotation(self, numbers: Sequence[float], angle: float) -> np.ndarray:
        """As `Orientation.rotation`."""
        return vector_rotation(np.array(numbers) * angle)

    def numbers(self, rotation: np.ndarray, old: Sequence[float], angle: float) -> tuple[float, ...]:
        """As `Orientation.numbers`: the angle may differ by whole turns."""
        vector = rotation_vector(rotation)
        turn = float(np.linalg.norm(vector))
        if turn < 1e-12:
            return tuple(vector.tolist())
        axis = vector / turn
        before = np.array(old) * angle
        nearest = min(
            (axis * (turn + 2 * np.pi * k) for k in range(-2, 3)),
            key=lambda other: float(np.linalg.norm(other - before)),
        )
        return tuple((nearest / angle).tolist())


@dataclass(frozen=True)
class Quaternion(Orientation):
    """Unit quaternion, scalar first (ABB); it is normalised where rounding has made it longer or shorter."""

    count: ClassVar[int] = 4

    def is_valid(self, numbers: Sequence[float]) -> bool:
        """As `Orientation.is_valid`: zeros are none."""
        return float(np.linalg.norm(numbers)) > _SHORTEST

    def rotation(self, numbers: Sequence[float], angle: float) -> np.ndarray:
        """As `Orientation.rotation`."""
        return wxyz_rotation(np.array(numbers) / np.linalg.norm(numbers))

    def numbers(self, rotation: np.ndarray, old: Sequence[float], angle: float) -> tuple[float, ...]:
        """As `Orientation.numbers`: q and -q are the same."""
        wxyz = rotation_wxyz(rotation)
        return tuple((-wxyz if wxyz @ np.array(old) < 0 else wxyz).tolist())


@dataclass(frozen=True)
class RollPitchYaw(Orientation):
    """Angles about fixed axes, R = R_z(yaw) R_y(pitch) R_x(roll).

    KUKA writes yaw, pitch, roll as A, B, C (`order` (2, 1, 0)), Fanuc roll, pitch, yaw as W, P, R (`order` (0, 1, 2)).
    """

    order: tuple[int, int, int]

    def rotation(self, numbers: Sequence[float], angle: float) -> np.ndarray:
        """As `Orientation.rotation`."""
        rpy = np.empty(3)
        rpy[list(self.order)] = numbers
        return rpy_rotation(rpy * angle)

    def numbers(self, rotation: np.ndarray, old: Sequence[float], angle: float) -> tuple[float, ...]:
        """As `Orientation.numbers`: of the two triples of a rotation the nearest one, every angle within half a turn of the old one.

        At pitch ±90°, where roll and yaw are not determined one by one, the yaw stays.
        """
        before = np.empty(3)
        before[list(self.order)] = np.array(old) * angle
        roll, pitch, yaw = rotation_rpy(rotation)
        triples = [np.array([roll, pitch, yaw]), np.array([roll + np.pi, np.pi - pitch, yaw + np.pi])]
        if np.hypot(rotation[0, 0], rotation[1, 0]) < _SINGULAR:
            across = np.array([-np.sin(before[2]), np.cos(before[2]), 0.0]) @ rotation
            triples = [np.array([np.arctan2(-across[2], across[1]), pitch, before[2]])]
        turns = [each + 2 * np.pi * np.round((before - each) / (2 * np.pi)) for each in triples]
        nearest = min(turns, key=lambda each: float(np.abs(each - before).max()))
        return tuple((nearest[list(self.order)] / angle).tolist())


_SHORTEST = 1e-3
"""Length below which a quaternion that is not normalised is none."""
_SINGULAR = 1e-9
"""Cosine of the pitch below which roll and yaw are not determined one by one."""
