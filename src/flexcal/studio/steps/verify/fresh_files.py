"""Files of measured poses that a calibration was not made from."""

from __future__ import annotations

from flexcal.errors import FlexcalError
from flexcal.files.formats import read_estimates
from flexcal.studio.project import CALIBRATION, CHECKED, Project, pose_files

_INPUT = "input."


def fresh_files(project: Project) -> list[str]:
    """Names of tables of measured poses other than the calibration's own; that of a guided session first."""
    fitted = _fitted(project)
    names = [name for name in pose_files(project) if name.rpartition("/")[2] not in fitted]
    return sorted(names, key=lambda name: name != CHECKED)


def _fitted(project: Project) -> set[str]:
    """Names, without folders, of the files that the calibration read."""
    try:
        blocks = read_estimates(project.folder / CALIBRATION / "estimates.yaml")
    except (FlexcalError, OSError):
        return set()
    if "calibration" not in blocks:
        return set()
    keys = blocks["calibration"].provenance
    return {key.removeprefix(_INPUT).rpartition("/")[2] for key in keys if key.startswith(_INPUT)}
