"""Links of a robot that touch."""

from __future__ import annotations

import numpy as np

from flexcal.design.scene import CollisionChecker


def colliding_links(checker: CollisionChecker, q: np.ndarray) -> frozenset[int]:
    """Joints whose links touch each other, the floor or an obstacle at joint positions `q` (n,); −1 for the base and what stands."""
    joints = {shape.name: shape.joint for shape in checker.shapes}
    return frozenset(joints[name] for pair in checker.colliding(q) for name in pair if name in joints)
