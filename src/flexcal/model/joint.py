"""A joint of the kinematic tree, as the URDF gives it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Joint:
    """A revolute or prismatic joint and where its frame lies in the parent link.

    `rotation` (3, 3) and `translation` (3,) map joint coordinates to the parent link's; `axis` (3,) is a unit vector in the joint
    frame; `normals` (2, 3) are the axes of `misalignment_1` and `misalignment_2`; `parent` is the index of the parent joint, -1 for
    the base; limits in rad or m, rad/s, N m.
    """

    name: str
    link: str
    parent: int
    kind: str
    rotation: np.ndarray
    translation: np.ndarray
    axis: np.ndarray
    normals: np.ndarray
    lower: float
    upper: float
    velocity: float
    effort: float


def normals_to(axis: np.ndarray) -> np.ndarray:
    """The two unit vectors normal to `axis`, in cyclic order: y, z for x; z, x for y; x, y for z, as (2, 3).

    An axis along none of these gets the nearest ones, orthonormalised so that (axis, first, second) is right-handed.
    """
    main = int(np.argmax(np.abs(axis)))
    first = np.eye(3)[(main + 1) % 3]
    first = first - axis * (axis @ first)
    first /= np.linalg.norm(first)
    second = np.cross(axis, first) * np.sign(axis[main])
    return np.array([first, second])
