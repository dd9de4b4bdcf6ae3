"""Joint of the kinematic tree, as the URDF gives it."""

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


@dataclass(frozen=True, eq=False)
class ElasticJoint:
    """A drive spring and, with `bearings`, two bearing springs at joint `index`.

    `frame` (3, 3) has the bearing's x, y, z as columns in the joint frame, z being the joint axis; `stiffness` (3,) in N m/rad and
    `damping` (3,) in N m s/rad are for tilt about x, tilt about y and the drive (nan without bearings). With `tilts_first` the tilts come
    before the joint's rotation, about axes fixed to the parent link.
    """

    index: int
    name: str
    frame: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    bearings: bool
    tilts_first: bool

    @property
    def components(self) -> tuple[int, ...]:
        """Elastic coordinates from base to tool: 2 twist, 1 tilt about y, 0 tilt about x."""
        if not self.bearings:
            return (2,)
        return (1, 0, 2) if self.tilts_first else (2, 1, 0)
