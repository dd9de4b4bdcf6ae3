"""Surface of a robot's links for drawing: the visual or collision shapes of its URDF, else capsules from joint to joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.errors import InputError
from flexcal.model.kinematics.link_poses import link_frames
from flexcal.model.kinematics.placements import joint_placement, point_placement
from flexcal.model.kinematics.triangle_meshes import box, capsule, cylinder, decimated, ellipsoid
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import locked_joints, pinocchio_model, pinocchio_shapes, read_elements

_MOST = 6000
"""Largest number of triangles of the whole arm."""
_SLENDER = 0.045
"""Ratio of a capsule's radius to the length of the arm."""
_SHAPES = ("visual", "collision")


@dataclass(frozen=True, eq=False)
class LinkSurface:
    """Triangles of all links: `vertices` (V, 3) m in the link of the joint `owner` (V,), −1 for the base; `triangles` (F, 3)."""

    vertices: np.ndarray
    owner: np.ndarray
    triangles: np.ndarray

    @classmethod
    def of(cls, model: RobotModel) -> LinkSurface:
        """Surface from the URDF's visual shapes; without them, or with missing meshes, from its collision shapes; else from capsules."""
        return cls._joined(_urdf_shapes(model) or link_capsules(model))

    @classmethod
    def _joined(cls, parts: list[tuple[int, np.ndarray, np.ndarray]]) -> LinkSurface:
        total = sum(len(triangles) for _, _, triangles in parts)
        vertices, owners, triangles, start = [], [], [], 0
        for joint, corners, faces in parts:
            kept, faces = decimated(corners, faces, max(12, _MOST * len(faces) // total))
            vertices.append(kept)
            owners.append(np.full(len(kept), joint))
            triangles.append(faces + start)
            start += len(kept)
        return cls(np.concatenate(vertices), np.concatenate(owners), np.concatenate(triangles))

    def at(self, model: RobotModel, q: np.ndarray) -> np.ndarray:
        """Vertices (N, V, 3), m, in the base frame at joint positions `q` (N, n), geometric errors included, undeflected."""
        rotation, origin = link_frames(model, q)
        moving = self.owner >= 0
        placed = np.broadcast_to(self.vertices, (len(q), *self.vertices.shape)).copy()
        own = self.owner[moving]
        turned = np.einsum("nvij,vj->nvi", rotation[:, own], self.vertices[moving])
        placed[:, moving] = turned + origin[:, own]
        return placed


def _urdf_shapes(model: RobotModel) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """(joint, vertices in its link, triangles) of every shape; empty where the URDF has none that can be read."""
    if not any(link.find(shape) for link in read_elements(model.urdf).all("link") for shape in _SHAPES):
        return []
    try:
        _, whole = pinocchio_model(model.urdf)
    except InputError:
        return []
    import pinocchio as pin

    for kind in (pin.GeometryType.VISUAL, pin.GeometryType.COLLISION):
        try:
            shapes = pinocchio_shapes(whole, model.urdf, kind)
        except (ValueError, RuntimeError):
            continue
        reduced, shapes = pin.buildReducedModel(whole, shapes, *locked_joints(whole, model.config.locked))
        joints = {reduced.getJointId(name): k for k, name in enumerate(model.joint_names)} | {0: -1}
        parts = []
        for item in shapes.geometryObjects:
            mesh = _mesh(item.geometry)
            if mesh is None or item.parentJoint not in joints:
                continue
            placed = mesh[0] @ np.array(item.placement.rotation).T + np.array(item.placement.translation)
            parts.append((joints[item.parentJoint], placed, mesh[1]))
        if parts:
            return parts
    return []


def _mesh(shape: Any) -> tuple[np.ndarray, np.ndarray] | None:
    """Triangles of a coal shape; None for a shape type that is not drawn."""
    import coal

    match shape:
        case coal.Box():
            return box(np.array(shape.halfSide))
        case coal.Cylinder():
            return cylinder(shape.radius, shape.halfLength)
        case coal.Capsule():
            return capsule(shape.radius, shape.halfLength)
        case coal.Sphere():
            return ellipsoid(np.full(3, shape.radius))
        case coal.BVHModelBase() if shape.num_tris:
            corners = [shape.tri_indices(k) for k in range(shape.num_tris)]
            return np.array(shape.vertices()), np.array([(t[0], t[1], t[2]) for t in corners])
    return None


def link_capsules(model: RobotModel) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """Capsules in every link from its joint to the next joints and to the first point.

    (joint or −1 for the base, vertices (V, 3) m in its link, triangles (F, 3)) of each.
    """
    parts = []
    for owner, end, radius in capsule_axes(model):
        length = float(np.linalg.norm(end))
        vertices, triangles = capsule(radius, length / 2)
        parts.append(
            (owner, (vertices + np.array([0.0, 0.0, length / 2])) @ _towards(end / length).T, triangles)
        )
    return parts


def capsule_axes(model: RobotModel) -> list[tuple[int, np.ndarray, float]]:
    """Axes of `link_capsules`, from the origin of their link: (joint or −1 for the base, end (3,) m in its link, radius m) of each."""
    ends = [(model.joints[k].parent, joint_placement(model, k)[0]) for k in range(len(model.joints))]
    ends += [point_placement(model, name)[:2] for name in list(model.points)[:1]]
    lengths = [float(np.linalg.norm(end)) for _, end in ends]
    radius = _SLENDER * sum(lengths)
    return [
        (owner, end, min(radius, 0.6 * length))
        for (owner, end), length in zip(ends, lengths, strict=True)
        if length >= 1e-6
    ]


def _towards(direction: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) that takes the z axis to a unit vector."""
    across = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(direction, across), direction], axis=1)
