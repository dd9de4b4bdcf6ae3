"""Frames in the words of robot controllers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.model.parts import rotation_rpy, rotation_vector, rotation_wxyz
from flexcal.units import DEGREE, MILLIMETRE


def controller_forms(origin: np.ndarray, rotation: np.ndarray, name: str) -> dict[str, str]:
    """A frame (origin (3,), m; rotation (3, 3)) in the base frame as controllers write it, by controller.

    ABB's `wobjdata` has mm and a quaternion, scalar first; KUKA's `BASE_DATA` mm and degrees about z, the turned y and the turned x;
    FANUC's user frame mm and degrees about the fixed x, y, z; Universal Robots' pose m and a rotation vector in rad.
    """
    x, y, z = (f"{value:.3f}" for value in origin / MILLIMETRE + 0.0)
    roll, pitch, yaw = (f"{value:.4f}" for value in rotation_rpy(rotation) / DEGREE + 0.0)
    quaternion = _numbers(rotation_wxyz(rotation), 6)
    urdf = f'xyz="{" ".join(_texts(origin, 6))}" rpy="{" ".join(_texts(rotation_rpy(rotation), 6))}"'
    return {
        "ABB": f'PERS wobjdata {name} := [FALSE,TRUE,"",[[{x},{y},{z}],[{quaternion}]],[[0,0,0],[1,0,0,0]]];',
        "KUKA": f"{{X {x},Y {y},Z {z},A {yaw},B {pitch},C {roll}}}",
        "FANUC": f"X {x} Y {y} Z {z} W {roll} P {pitch} R {yaw}",
        "UR": f"p[{_numbers(origin, 6)},{_numbers(rotation_vector(rotation), 6)}]",
        "URDF": f"<origin {urdf}/>",
    }


def _numbers(values: np.ndarray, digits: int) -> str:
    return ",".join(_texts(values, digits))


def _texts(values: np.ndarray, digits: int) -> Sequence[str]:
    return [f"{value + 0.0:.{digits}f}" for value in values]
