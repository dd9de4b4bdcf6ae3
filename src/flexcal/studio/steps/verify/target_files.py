"""Tables that may be targets of the tool."""

from __future__ import annotations

from flexcal.data.tables import open_table
from flexcal.errors import FlexcalError
from flexcal.studio.project import COMPUTED, Project, is_result


def target_files(project: Project) -> list[str]:
    """Names of tables with the numbers of poses and joint positions or points, those called targets first."""
    names = []
    for name in project.files(".csv", ".parquet"):
        if is_result(project, name):
            continue
        try:
            columns = set(open_table(project.folder / name).columns)
        except FlexcalError:
            continue
        if "pose" in columns and ("q1" in columns or {"x", "y", "z"} <= columns) and not columns & COMPUTED:
            names.append(name)
    return sorted(names, key=lambda name: ("target" not in name, name))
