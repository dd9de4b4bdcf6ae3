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


def bearing_frame(joint: Joint) -> np.ndarray:
    """The default bearing frame (3, 3) of a joint: z its axis, x the first axis normal to it."""
    (x, y, z), (a, b, c) = joint.normals[0].tolist(), joint.axis.tolist()
    return np.array([[x, b * z - c * y, a], [y, c * x - a * z, b], [z, a * y - b * x, c]])


def kinematic_tree(
    joints: Sequence[Joint], bearing_frames: Mapping[int, np.ndarray], bearings: Bearings | None = None
) -> Tree:
    """Kinematic tree of the given joints for the kernels, with the bearing frames (3, 3) of the elastic ones by joint index."""
    return Tree.build(
        [j.parent for j in joints],
        [j.kind == "prismatic" for j in joints],
        np.array([j.rotation for j in joints]),
        np.array([j.translation for j in joints]),
        np.array([j.normals for j in joints]),
        np.array([bearing_frames.get(i, bearing_frame(j)) for i, j in enumerate(joints)]),
        bearings == "before",
    )
