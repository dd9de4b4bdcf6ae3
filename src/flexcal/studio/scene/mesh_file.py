"""Mesh files of a URDF, looked for in the folder of a project and nowhere else."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from flexcal.errors import InputError
from flexcal.files.transaction import read_bytes, real_path

FORMATS = ("stl", "obj", "dae")
"""Endings of the files that are read."""
_LARGEST = 100_000_000
"""Largest size of a file, bytes."""


@dataclass(frozen=True)
class MeshNotDrawn:
    """Why the mesh that a URDF names as `name` is not drawn; `reason` is a clause."""

    name: str
    reason: str


@dataclass(frozen=True)
class MeshFolder:
    """Where meshes may be: the folder `project`, with the URDF `urdf` as the place from which relative names count."""

    project: Path
    urdf: Path

    def find(self, name: str) -> Path | MeshNotDrawn:
        """File that a URDF calls `name`: a path relative to the URDF, or `package://package/path` in its folder or one above it."""
        outside = False
        for candidate in self._candidates(name):
            try:
                real = real_path(candidate)
                if not real.is_file():
                    continue
                if real.is_relative_to(real_path(self.project)):
                    return real
                outside = True
            except (OSError, ValueError, RuntimeError):  # too long, a NUL, a circle of links
                continue
        return MeshNotDrawn(
            name, "it is outside the project's folder" if outside else "there is no such file"
        )

    def read(self, name: str) -> tuple[np.ndarray, np.ndarray] | MeshNotDrawn:
        """Vertices (V, 3), in the file's unit, and triangles (F, 3) of the mesh that a URDF calls `name`."""
        ending = name.rpartition(".")[2].lower()
        if ending not in FORMATS:
            return MeshNotDrawn(name, f"the studio draws {', '.join(FORMATS)} only")
        path = self.find(name)
        return path if isinstance(path, MeshNotDrawn) else _triangles(name, path, ending)

    def _candidates(self, name: str) -> list[Path]:
        folder = self.urdf.absolute().parent
        if not name.startswith("package://"):
            return [folder / unquote(name.removeprefix("file://"))]
        package, _, inside = unquote(name.removeprefix("package://")).partition("/")
        above = [folder, *folder.parents]
        return [up / package / inside for up in above] + [up / inside for up in above if up.name == package]


def _triangles(name: str, path: Path, ending: str) -> tuple[np.ndarray, np.ndarray] | MeshNotDrawn:
    import trimesh

    try:
        # from memory, so that textures and materials beside the file are not looked for
        content = io.BytesIO(read_bytes(path, limit=_LARGEST))
        loaded = trimesh.load_scene(content, file_type=ending, process=False, skip_materials=True)
        mesh = loaded.to_mesh()
        vertices, faces = np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=int)
    except ImportError as problem:
        return MeshNotDrawn(name, f"reading .{ending} needs the package {problem.name}")
    except InputError:
        return MeshNotDrawn(name, f"it is larger than {_LARGEST // 1_000_000} MB")
    except Exception as problem:  # whatever a parser raises on a broken file
        return MeshNotDrawn(name, f"it cannot be read ({type(problem).__name__})")
    if not len(faces) or not np.isfinite(vertices).all():
        return MeshNotDrawn(name, "it has no triangles with finite corners")
    return vertices, faces
