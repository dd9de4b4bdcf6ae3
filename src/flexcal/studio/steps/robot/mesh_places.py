"""Where the meshes that a URDF names belong in the project's folder."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote

from flexcal.errors import InputError
from flexcal.model.urdf import read_elements
from flexcal.studio.project import Project


def mesh_places(project: Project) -> dict[Path, str]:
    """Files in the project that its URDFs take for meshes, whether they are there or not, and the name that the URDF gives them.

    Meshes whose place is outside the project are left out, and URDFs that cannot be read.
    """
    places = {}
    for name in project.files(".urdf"):
        urdf = project.folder / name
        try:
            names = list(dict.fromkeys(read_elements(urdf).mesh_names()))
        except InputError:
            continue
        for mesh in names:
            try:
                place = project.path(_place(urdf, mesh).relative_to(project.folder).as_posix())
            except (InputError, ValueError):
                continue
            places[place] = mesh
    return places


def _place(urdf: Path, name: str) -> Path:
    """Where a mesh is looked for first; the package of `package://package/path` is a folder beside the URDF."""
    if name.startswith("package://"):
        return urdf.parent / unquote(name.removeprefix("package://"))
    return urdf.parent / unquote(name.removeprefix("file://"))
