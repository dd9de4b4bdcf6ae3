"""Tables of a project by their columns."""

from __future__ import annotations

from collections.abc import Callable

from flexcal.data.tables import open_table
from flexcal.errors import FlexcalError
from flexcal.studio.project import COMPUTED, Project, is_result


def project_tables(project: Project, is_wanted: Callable[[set[str]], bool]) -> list[str]:
    """Names of tables that are no results, whose columns are wanted and none computed; files that cannot be read are left out."""
    names = []
    for name in project.files(".csv", ".parquet"):
        if is_result(project, name):
            continue
        try:
            columns = set(open_table(project.folder / name).columns)
        except FlexcalError:
            continue
        if is_wanted(columns) and not columns & COMPUTED:
            names.append(name)
    return names
