"""Whether two robots have the same nominal kinematics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.model.parts import Joint
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

_SAME_LENGTH, _SAME_DIRECTION = 1e-6, 1e-6
"""m and rad: differences that rounding in files leaves."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class NominalJoint:
    """A joint's kind, parent, translation (m) and the columns of its rotation in the parent link, and its axis in its own frame."""

    kind: str
    parent: str
    xyz: Vector
    x: Vector
    z: Vector
    axis: Vector

    @classmethod
    def of(cls, model: RobotModel, joint: Joint) -> NominalJoint:
        """As the URDF has a joint of the robot."""
        parent = "" if joint.parent < 0 else model.joint_names[joint.parent]
        rotation = joint.rotation
        vectors = [joint.translation, rotation[:, 0], rotation[:, 2], joint.axis]
        xyz, x, z, axis = ((float(v[0]), float(v[1]), float(v[2])) for v in vectors)
        return cls(joint.kind, parent, xyz, x, z, axis)

    def difference(self, other: NominalJoint) -> str:
        """A clause on how another joint of this name differs; empty where it does not."""
        if (self.kind, self.parent) != (other.kind, other.parent):
            return f"is {other.kind} after {other.parent or 'the base'}, not {self.kind} after {self.parent or 'the base'}"
        off = float(np.linalg.norm(np.subtract(self.xyz, other.xyz)))
        if off > _SAME_LENGTH:
            return f"is {off / MILLIMETRE:.4g} mm elsewhere in its parent link"
        pairs = ((self.x, other.x), (self.z, other.z), (self.axis, other.axis))
        turned = max(float(np.linalg.norm(np.subtract(a, b))) for a, b in pairs)
        return "has another direction" if turned > _SAME_DIRECTION else ""


def nominal_joints(model: RobotModel) -> dict[str, NominalJoint]:
    """The joints of a robot by name."""
    return {joint.name: NominalJoint.of(model, joint) for joint in model.joints}


def difference(one: RobotModel, other: RobotModel) -> str:
    """A clause on the first joint in which two robots differ; empty where there is none."""
    return difference_of(nominal_joints(one), nominal_joints(other))


def difference_of(one: dict[str, NominalJoint], other: dict[str, NominalJoint]) -> str:
    """As `difference`, of joints by name."""
    if list(one) != list(other):
        unlike = sorted(set(one) ^ set(other))
        return f"the joints differ ({', '.join(unlike)})" if unlike else "the joints are in another order"
    for name, joint in one.items():
        clause = joint.difference(other[name])
        if clause:
            return f"{name} {clause}"
    return ""
