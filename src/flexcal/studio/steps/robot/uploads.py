"""Files that the page sends: URDFs and meshes, checked before they are written into the project's folder."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import atomic_path, read_bytes
from flexcal.model.urdf import read_elements, xacro_error
from flexcal.studio.project import Project
from flexcal.studio.steps.robot.mesh_places import mesh_places

LARGEST = 50_000_000
"""Bytes of a file."""
_NAME = re.compile(r"\w[\w .()+@-]{0,99}")
_URDF = (".urdf", ".xml")
_MESHES = (".stl", ".obj", ".dae")


def write_upload(project: Project, name: str, content: bytes, *, replace: bool) -> Path:
    """Write a URDF, or a mesh that a URDF of the project names, and return its place; nothing is written where it is refused.

    Parameters
    ----------
    project : Project
        The folder.
    name : str
        Name of the file, as the page says it.
    content : bytes
        The file.
    replace : bool
        Whether a file of this name is replaced.

    Raises
    ------
    InputError
        For a name with a path or other signs than letters, digits, space and . ( ) + @ _ -, a file that is empty, too large or neither
        URDF nor mesh, a mesh that no URDF names, and one that is there already.
    """
    require_size(name, len(content))
    ending = Path(name).suffix.lower()
    if not _NAME.fullmatch(name) or name != name.strip() or name.endswith("."):
        raise InputError(
            "E-STUDIO-020",
            f"'{_shown(name)}' is no name for a file here; rename it with letters, digits and . _ - alone, as robot.urdf.",
        )
    if not content:
        raise InputError("E-STUDIO-021", f"{name} is empty; upload the robot's URDF.")
    if ending in _URDF:
        _require_urdf(name, content)
        place = project.path(Path(name).with_suffix(".urdf").name)
    elif ending in _MESHES:
        place = _mesh_place(project, name)
    elif ending == ".xacro":
        raise xacro_error(Path(name))
    else:
        raise InputError(
            "E-STUDIO-023",
            f"{name} is neither a URDF nor a mesh ({', '.join(_MESHES)}); upload one of these, and put tables into the folder.",
        )
    if place.exists() and read_bytes(place) != content and not replace:
        raise InputError(
            "E-STUDIO-024",
            f"{place.relative_to(project.folder)} is there already with other content; rename the new one, or tick 'Replace a file of "
            "the same name'.",
        )
    with atomic_path(place) as temporary:
        temporary.write_bytes(content)
    return place


def require_size(name: str, size: int) -> None:
    """Raise `InputError` for a file of more bytes than are taken."""
    if size > LARGEST:
        raise InputError(
            "E-STUDIO-025",
            f"{_shown(name)} has {size / 1e6:.0f} MB, more than the {LARGEST // 1_000_000} MB that are taken here; "
            "put it into the folder itself.",
        )


def _shown(name: str) -> str:
    """A name that may be anything, in a sentence."""
    return "".join(letter if letter.isprintable() else "·" for letter in name[:100])


def _require_urdf(name: str, content: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(content)
        try:
            root = read_elements(path)
        except InputError as problem:
            raise InputError(problem.code, str(problem).replace(str(path), name)) from problem
    if root.tag != "robot" or root.find("link") is None:
        raise InputError(
            "E-STUDIO-026",
            f"{name} is XML, but no URDF: it lacks <robot> with a <link> inside; upload the robot's URDF.",
        )


def _mesh_place(project: Project, name: str) -> Path:
    places = [place for place in mesh_places(project) if place.name == name]
    if len(places) == 1:
        return places[0]
    listed = " and ".join(place.relative_to(project.folder).as_posix() for place in places)
    reason = f"it may be {listed}" if places else "no URDF of the folder names such a mesh there"
    raise InputError(
        "E-STUDIO-028",
        f"{name}: {reason}; put the mesh into the folder itself, where the URDF looks for it.",
    )
