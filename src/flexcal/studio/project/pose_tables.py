"""Tables of the project that may be measured poses."""

from __future__ import annotations

from flexcal.studio.project.project import CALIBRATION, MEASURED, VERIFICATION, Project

_HEADER = 4096
"""Bytes of a file in which its header is looked for."""


def pose_files(project: Project) -> list[str]:
    """Names of tables that may be measured poses: a guided session's first, then by size, those without joint columns last.

    Tables within folders of results are left out.
    """
    names = [
        name
        for name in project.files(".csv", ".parquet")
        if not name.startswith((f"{CALIBRATION}/", f"{VERIFICATION}/")) and not _is_result(project, name)
    ]

    def order(name: str) -> tuple[bool, bool, int]:
        path = project.folder / name
        return name != MEASURED, not _has_joints(path), -path.stat().st_size

    return sorted(names, key=order)


def _is_result(project: Project, name: str) -> bool:
    return (project.folder / name).with_name("results.json").is_file() and "/" in name


def _has_joints(path) -> bool:
    if path.suffix == ".parquet":
        return True
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEADER).decode("utf-8", "replace").splitlines()
    except OSError:
        return False
    columns = {cell.strip().strip('"') for cell in head[0].split(",")} if head else set()
    return "q1" in columns and not columns.isdisjoint(
        {"x", "length", "theodolite_h", "u", "inclination", "socket"}
    )
