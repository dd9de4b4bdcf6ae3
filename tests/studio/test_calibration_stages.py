"""What the Calibrate step says of its stages: from which files a result is, and what is lacking."""

from __future__ import annotations

import shutil
from pathlib import Path

import calibrated_ur5
import pytest

from flexcal.studio.project import Project
from flexcal.studio.steps.calibrate.stages import Stage, stages


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return calibrated_ur5.make(tmp_path_factory.mktemp("stages") / "ur5")


def geometry(folder: Path, measured: str) -> Stage:
    return next(one for one in stages(Project.open(folder), measured) if one.title == "Geometry")


def test_a_result_is_of_the_files_it_was_fitted_to(calibrated: Path) -> None:
    assert (geometry(calibrated, "grid.csv").state, geometry(calibrated, "grid.csv").sentence) == (
        "done",
        "from grid.csv",
    )
    other = geometry(calibrated, "random.csv")
    assert (other.state, other.sentence) == (
        "outdated",
        "calibrated from grid.csv; random.csv is not in it",
    )


def test_a_table_under_another_name_is_the_same(calibrated: Path, tmp_path: Path) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(calibrated, folder)
    shutil.copy(folder / "grid.csv", folder / "mine.csv")
    assert geometry(folder, "mine.csv").state == "done"


def test_rows_that_came_later_are_told(calibrated: Path, tmp_path: Path) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(calibrated, folder)
    lines = (folder / "grid.csv").read_text().splitlines(keepends=True)
    (folder / "grid.csv").write_text("".join([*lines, lines[-1]]))
    changed = geometry(folder, "grid.csv")
    assert changed.state == "outdated" and "changed since" in changed.sentence


def test_what_is_optional_is_not_called_blocked(calibrated: Path) -> None:
    listed = {one.title: one for one in stages(Project.open(calibrated), "grid.csv")}
    for title in ("Inertias and friction", "Frequency responses", "Stiffness and damping"):
        assert listed[title].sentence.startswith("optional, no data: ")
    assert "masses of the URDF" in listed["Inertias and friction"].sentence
