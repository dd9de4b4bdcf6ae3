"""Shapes of a robot's links for drawing: visual shapes of the URDF, else collision shapes, else capsules from joint to joint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.errors import InputError
from flexcal.model.kinematics import box, cylinder, decimated, ellipsoid, link_capsules
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import Element, read_elements, read_urdf
from flexcal.studio.scene.mesh_file import MeshFolder, MeshNotDrawn

_MOST = 40_000
"""Largest number of triangles of the whole robot, which software rendering still turns smoothly."""

Triangles = tuple[np.ndarray, np.ndarray]
"""Vertices (V, 3) and triangles (F, 3) of vertex numbers."""


@dataclass(frozen=True, eq=False)
class LinkShapes:
    """Triangles of every link.

    `meshes`: by the joint that moves them, −1 for the base, vertices (V, 3), m, in the frame of its link, and triangles (F, 3).
    `missing`: the meshes of the URDF that could not be drawn.
    """

    meshes: dict[int, Triangles]
    missing: tuple[MeshNotDrawn, ...]

    @classmethod
    def of(cls, model: RobotModel, project: Path) -> LinkShapes:
        """Shapes of `model`; meshes are looked for below the folder `project` only.

        A link whose visual meshes are not all there has its collision shapes, or a capsule if these are missing too.
        """
        shapes = _UrdfShapes(MeshFolder(project, model.urdf))
        frames = read_urdf(model.urdf, model.config.locked).frames
        drawn: dict[int, list[Triangles]] = {}
        incomplete: set[int] = set()
        for link in read_elements(model.urdf).all("link"):
            frame = frames.get(link.attributes.get("name", ""))
            if frame is None:
                continue
            triangles = shapes.of_link(link)
            if triangles is None:
                incomplete.add(frame.joint)
                continue
            drawn.setdefault(frame.joint, []).extend(
                (vertices @ frame.rotation.T + frame.translation, faces) for vertices, faces in triangles
            )
        bare = incomplete - drawn.keys() if any(drawn.values()) else {-1, *range(len(model.joints))}
        for joint, vertices, faces in link_capsules(model):
            if joint in bare:
                drawn.setdefault(joint, []).append((vertices, faces))
        return cls(
            _reduced({joint: _joined(parts) for joint, parts in drawn.items() if parts}), shapes.missing
        )


class _UrdfShapes:
    """Reads the shapes of links, and remembers what was missing."""

    def __init__(self, folder: MeshFolder) -> None:
        self.folder = folder
        self._missing: dict[MeshNotDrawn, None] = {}

    @property
    def missing(self) -> tuple[MeshNotDrawn, ...]:
        return tuple(self._missing)

    def of_link(self, link: Element) -> list[Triangles] | None:
        """Shapes in the link's frame; empty for a link that has none, None for one whose shapes cannot be drawn."""
        complete = True
        for tag in ("visual", "collision"):
            parts = list(self._shapes(link, tag))
            triangles = [part for part in parts if part is not None]
            if triangles and len(triangles) == len(parts):
                return triangles
            complete = complete and not parts
        return [] if complete else None

    def _shapes(self, link: Element, tag: str) -> Iterator[Triangles | None]:
        owner = f"the <{tag}> of {link.attributes.get('name')}"
        for element in link.all(tag):
            try:
                yield self._shape(element, owner)
            except InputError as problem:
                self._missing[MeshNotDrawn(owner, str(problem))] = None
                yield None

    def _shape(self, element: Element, owner: str) -> Triangles | None:
        geometry = element.find("geometry")
        shape = None if geometry is None else next(iter(geometry.children), None)
        if shape is None:
            return None
        match shape.tag:
            case "box":
                vertices, faces = box(shape.numbers("size", 3, owner) / 2)
            case "cylinder":
                length = float(shape.numbers("length", 1, owner)[0])
                vertices, faces = cylinder(float(shape.numbers("radius", 1, owner)[0]), length / 2)
            case "sphere":
                vertices, faces = ellipsoid(np.repeat(shape.numbers("radius", 1, owner), 3))
            case "mesh":
                read = self.folder.read(shape.attributes.get("filename", ""))
                if isinstance(read, MeshNotDrawn):
                    self._missing[read] = None
                    return None
                scale = shape.numbers("scale", 3, owner) if "scale" in shape.attributes else np.ones(3)
                vertices, faces = read[0] * scale, read[1] if np.prod(scale) > 0 else read[1][:, ::-1]
            case _:
                return None
        origin = element.find("origin")
        if origin is None:
            return vertices, faces
        xyz = origin.numbers("xyz", 3, owner) if "xyz" in origin.attributes else np.zeros(3)
        rpy = origin.numbers("rpy", 3, owner) if "rpy" in origin.attributes else np.zeros(3)
        return vertices @ _roll_pitch_yaw(rpy).T + xyz, faces


def _roll_pitch_yaw(angles: np.ndarray) -> np.ndarray:
    (a, b, c), (sa, sb, sc) = np.cos(angles), np.sin(angles)
    return np.array(
        [
            [c * b, c * sb * sa - sc * a, c * sb * a + sc * sa],
            [sc * b, sc * sb * sa + c * a, sc * sb * a - c * sa],
            [-sb, b * sa, b * a],
        ]
    )


def _joined(parts: list[Triangles]) -> Triangles:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    faces = [triangles + start for (_, triangles), start in zip(parts, starts, strict=True)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces)


def _reduced(meshes: dict[int, Triangles]) -> dict[int, Triangles]:
    total = sum(len(faces) for _, faces in meshes.values())
    if total <= _MOST:
        return meshes
    return {
        joint: decimated(vertices, faces, max(60, _MOST * len(faces) // total))
        for joint, (vertices, faces) in meshes.items()
    }
