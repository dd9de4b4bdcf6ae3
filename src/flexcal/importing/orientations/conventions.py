"""Conventions by which three or four numbers are an orientation."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexcal.errors import InputError

AngleUnit = Literal["deg", "rad"]
_EULER = re.compile(r"([xyz]{3})-(intrinsic|extrinsic)")
_TRANSPOSED = "-transposed"
_KNOWN = "xyz-extrinsic, zyx-intrinsic and so on, rotation-vector, wxyz, xyzw, each also with -transposed"


@dataclass(frozen=True)
class Convention(ABC):
    """Meaning of the numbers in a row as the orientation of the target in the instrument's frame.

    transposed: they are the orientation of the instrument in the target's frame.
    """

    transposed: bool

    @property
    def option(self) -> str:
        """The value of --orientation."""
        return self._option() + (_TRANSPOSED if self.transposed else "")

    @property
    def words(self) -> str:
        """The convention in words, in the plural."""
        return self._words() + (" of the instrument in the target's frame" if self.transposed else "")

    def rotations(self, values: np.ndarray) -> np.ndarray:
        """Rotations (N, 3, 3) from the target's to the instrument's frame, of `values` (N, 3) or (N, 4)."""
        rotations = self._rotations(values)
        return np.swapaxes(rotations, 1, 2) if self.transposed else rotations

    @abstractmethod
    def _option(self) -> str: ...

    @abstractmethod
    def _words(self) -> str: ...

    @abstractmethod
    def _rotations(self, values: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True)
class EulerAngles(Convention):
    """Angles about three axes, one after the other.

    axes: their letters in the order of turning. intrinsic: about the axes as turned before, else about fixed ones; both are the same in the
    opposite order. columns: the value (from 0) that turns about each of the `axes`.
    """

    axes: str
    intrinsic: bool
    columns: tuple[int, int, int]
    unit: AngleUnit

    def _option(self) -> str:
        return f"{self.axes}-{'intrinsic' if self.intrinsic else 'extrinsic'}"

    def _words(self) -> str:
        about = "turned" if self.intrinsic else "fixed"
        return f"Euler angles {'-'.join(self.axes)} about {about} axes in {_spelled(self.unit)}"

    def _rotations(self, values: np.ndarray) -> np.ndarray:
        from scipy.spatial.transform import Rotation

        axes = self.axes.upper() if self.intrinsic else self.axes
        return Rotation.from_euler(axes, values[:, self.columns], degrees=self.unit == "deg").as_matrix()


@dataclass(frozen=True)
class RotationVector(Convention):
    """The axis of the rotation, as long as its angle."""

    unit: AngleUnit

    def _option(self) -> str:
        return "rotation-vector"

    def _words(self) -> str:
        return f"rotation vectors in {_spelled(self.unit)}"

    def _rotations(self, values: np.ndarray) -> np.ndarray:
        from scipy.spatial.transform import Rotation

        return Rotation.from_rotvec(values, degrees=self.unit == "deg").as_matrix()


@dataclass(frozen=True)
class Quaternion(Convention):
    """Quaternions of any norm, with the scalar first or last."""

    scalar_first: bool

    def _option(self) -> str:
        return "wxyz" if self.scalar_first else "xyzw"

    def _words(self) -> str:
        return f"quaternions with the scalar {'first' if self.scalar_first else 'last'}"

    def _rotations(self, values: np.ndarray) -> np.ndarray:
        from scipy.spatial.transform import Rotation

        return Rotation.from_quat(values, scalar_first=self.scalar_first).as_matrix()


def parse_convention(option: str, numbers: int, unit: AngleUnit, *, by_axis: bool) -> Convention:
    """The convention that --orientation names, of three or four `numbers` a row.

    `by_axis`: the columns are named by the axes x, y, z, so that a letter takes its own column; else they are in the order of turning.
    Raises `InputError` where there is no such convention, or not of so many numbers.
    """
    name, transposed = option.removesuffix(_TRANSPOSED), option.endswith(_TRANSPOSED)
    euler = _EULER.fullmatch(name)
    convention: Convention | None = None
    if name in ("wxyz", "xyzw"):
        convention = Quaternion(transposed, name == "wxyz")
    elif name == "rotation-vector":
        convention = RotationVector(transposed, unit)
    elif euler is not None and euler[1][0] != euler[1][1] != euler[1][2]:
        axes = euler[1]
        named = by_axis and len(set(axes)) == 3
        columns = ("xyz".index(axes[0]), "xyz".index(axes[1]), "xyz".index(axes[2])) if named else (0, 1, 2)
        convention = EulerAngles(transposed, axes, euler[2] == "intrinsic", columns, unit)
    if convention is None:
        raise InputError(
            "E-IMPORT-057", f"--orientation {option}: there is no such convention; it is {_KNOWN}."
        )
    if isinstance(convention, Quaternion) != (numbers == 4):
        raise InputError(
            "E-IMPORT-058",
            f"--orientation {option}: the file has {numbers} columns of orientation, which are no {convention.words}.",
        )
    return convention


def _spelled(unit: AngleUnit) -> str:
    return "degrees" if unit == "deg" else "rad"
