"""A URDF in Pinocchio: shapes of links, for collisions and drawings."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.errors import InputError
from flexcal.files.transaction import MEGABYTE, regular_path
from flexcal.model.urdf.elements import read_elements

LARGEST_MESH = 100 * MEGABYTE


def pinocchio_model(path: Path) -> tuple[str, Any]:
    """Text of a URDF that `read_urdf` reads, and Pinocchio's model of it; raises `InputError` for shapes that Pinocchio cannot read."""
    import pinocchio as pin

    text = read_elements(path).text()
    try:
        return text, pin.buildModelFromXML(text)
    except (ValueError, RuntimeError) as problem:
        raise InputError(
            "E-URDF-044",
            f"{path}: Pinocchio, which reads the shapes of links, cannot load this URDF; correct its <visual> and <collision> elements.",
        ) from problem


def pinocchio_shapes(model: Any, path: Path, kind: Any) -> Any:
    """Shapes of a `kind` (a `GeometryType`) of a URDF and Pinocchio's `model` of it; packages are looked for in the folders above it.

    Raises `InputError` for a mesh that is a pipe or a device or larger than `LARGEST_MESH`, else what Pinocchio does.
    """
    import pinocchio as pin

    root = read_elements(path)
    folders = [str(above) for above in path.absolute().parents]
    for name in root.mesh_names():
        place = name.rpartition("://")[2]
        for folder in ("", *folders):
            with suppress(OSError, ValueError):  # not every place has one, and Pinocchio says where none has
                regular_path(Path(folder, place), limit=LARGEST_MESH)
    return pin.buildGeomFromUrdfString(model, root.text(), kind, package_dirs=folders)


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
