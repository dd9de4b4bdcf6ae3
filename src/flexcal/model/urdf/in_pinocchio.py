"""A URDF in Pinocchio: shapes of links, for collisions and drawings."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.errors import InputError
from flexcal.files.transaction import MEGABYTE, read_bytes, regular_path
from flexcal.model.urdf.elements import read_elements
from flexcal.printable import excerpt, printable_errors

LARGEST_MESH = 100 * MEGABYTE
_MESHES = (".stl", ".dae", ".obj", ".ply")
"""Endings of meshes that are read; of the others some name further files."""
_MATERIALS = re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]+)", re.MULTILINE)
"""Files that an .obj names."""


def pinocchio_model(path: Path) -> tuple[str, Any]:
    """Text of a URDF that `read_urdf` reads, and Pinocchio's model of it; raises `InputError` for shapes that Pinocchio cannot read."""
    text = read_elements(path).text()
    try:
        return text, pinocchio_model_of(text)
    except (ValueError, RuntimeError) as problem:
        raise InputError(
            "E-URDF-044",
            f"{path}: Pinocchio, which reads the shapes of links, cannot load this URDF; correct its <visual> and <collision> elements.",
        ) from problem


def pinocchio_model_of(text: str) -> Any:
    """Pinocchio's model of the text of a URDF; raises `ValueError` or `RuntimeError` where it cannot read it."""
    import pinocchio as pin

    with printable_errors("Pinocchio"):
        return pin.buildModelFromXML(text)


def pinocchio_shapes(model: Any, path: Path, kind: Any) -> Any:
    """Shapes of a `kind` (a `GeometryType`) of a URDF and Pinocchio's `model` of it; packages are looked for in the folders above it.

    Raises `InputError` for a mesh, or a file that it names, that is a pipe or a device or larger than `LARGEST_MESH`, else what Pinocchio
    does.
    """
    import pinocchio as pin

    root = read_elements(path)
    folders = [str(above) for above in path.absolute().parents]
    for name in root.mesh_names():
        place = name.rpartition("://")[2]
        if Path(place).suffix.lower() not in _MESHES:
            raise ValueError(f"a mesh must end in {', '.join(_MESHES)}, unlike '{excerpt(name)}'")
        for folder in ("", *folders):
            for mesh in {Path(folder, place), Path(folder, place.lstrip("/"))}:
                with suppress(
                    OSError, ValueError
                ):  # not every place has one, and Pinocchio says where none has
                    _require_readable(regular_path(mesh, limit=LARGEST_MESH))
    with printable_errors("Pinocchio"):
        return pin.buildGeomFromUrdfString(model, root.text(), kind, package_dirs=folders)


def _require_readable(mesh: Path) -> None:
    """Raise `InputError` where a mesh names a file that is a pipe or a device, or a large one."""
    if mesh.suffix.lower() != ".obj":
        return
    named = [os.fsdecode(line) for line in _MATERIALS.findall(read_bytes(mesh, limit=LARGEST_MESH))]
    words = {word for line in named for word in (line.strip(), *line.split())}
    for material in {mesh.with_suffix(".mtl"), *(mesh.parent / word for word in words)}:
        with suppress(OSError, ValueError):
            regular_path(material, limit=LARGEST_MESH)


def locked_joints(model: Any, locked: Mapping[str, float]) -> tuple[list[int], np.ndarray]:
    """Arguments of Pinocchio's `buildReducedModel` that lock joints at positions (rad or m): joint numbers and a configuration (nq,)."""
    import pinocchio as pin

    q = pin.neutral(model)
    for name, position in locked.items():
        joint = model.joints[model.getJointId(name)]
        q[joint.idx_q : joint.idx_q + joint.nq] = (
            position if joint.nq == 1 else (np.cos(position), np.sin(position))
        )
    return [model.getJointId(name) for name in locked], q
