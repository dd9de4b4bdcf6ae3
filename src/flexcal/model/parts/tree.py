"""Kinematic tree as the compiled kernels take it, made of joints and bearing frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from flexcal.kernels import Tree
from flexcal.model.parts.joint import Joint

Bearings = Literal["before", "after"]
"""Location of the bearing springs: before the joint's rotation, about axes fixed to the parent link, or after it, about axes of the
child.
"""


def path_to(joints: Sequence[Joint], joint: int) -> tuple[int, ...]:
    """Indices of the joints from the base to a joint, inclusive; empty for -1, the base."""
    path: list[int] = []
    while joint >= 0:
        path.append(joint)
        joint = joints[joint].parent
    return tuple(reversed(path))


def branching_joints(joints: Sequence[Joint]) -> tuple[int, ...]:
    """Indices of the joints that are not the first of those on their parent's link, as the second shoulder of a torso.

    The length vector of the parent joint places all of these together, so each but the first has a displacement of its own.
    """
    seen: set[int] = set()
    branching = []
    for i, joint in enumerate(joints):
        if joint.parent in seen:
            branching.append(i)
        seen.add(joint.parent)
    return tuple(branching)


def bearing_frame(joint: Joint) -> np.ndarray:
    """The default bearing frame (3, 3) of a joint: z its axis, x the first axis normal to it."""
    (x, y, z), (a, b, c) = joint.normals[0].tolist(), joint.axis.tolist()
    return np.array([[x, b * z - c * y, a], [y, c * x - a * z, b], [z, a * y - b * x, c]])


def kinematic_tree(
    joints: Sequence[Joint],
    bearing_frames: Mapping[int, np.ndarray],
    bearings: Bearings | None = None,
    origin_error: np.ndarray | None = None,
) -> Tree:
    """Kinematic tree of the given joints for the kernels, with the bearing frames (3, 3) of the elastic ones by joint index.

    `origin_error` (n, 3), m, displaces the joints in their parent links.
    """
    origins = np.array([j.translation for j in joints])
    return Tree.build(
        [j.parent for j in joints],
        [j.kind == "prismatic" for j in joints],
        np.array([j.rotation for j in joints]),
        origins if origin_error is None else origins + origin_error,
        np.array([j.normals for j in joints]),
        np.array([bearing_frames.get(i, bearing_frame(j)) for i, j in enumerate(joints)]),
        bearings == "before",
    )
