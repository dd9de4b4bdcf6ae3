"""Tables that may be targets of the tool."""

from __future__ import annotations

from flexcal.studio.project import Project
from flexcal.studio.steps.verify.project_tables import project_tables


def target_files(project: Project) -> list[str]:
    """Names of tables with the numbers of poses and joint positions or points, those called targets first."""
    names = project_tables(
        project,
        lambda columns: "pose" in columns and ("q1" in columns or {"x", "y", "z"} <= columns),
    )
    return sorted(names, key=lambda name: ("target" not in name, name))
