"""The project's folder: which files it offers, and that nothing outside it is reached."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from refusals import refused

from flexcal.errors import InputError
from flexcal.studio.project import Choices, Project, pose_files, read_plan_file, sole_studio
from flexcal.studio.steps.plan.plan_files import _says
from flexcal.studio.steps.plan.plan_results import plan_results


@pytest.fixture
def project(tmp_path: Path) -> Project:
    folder = tmp_path / "cell"
    folder.mkdir()
    return Project.open(folder)


@pytest.mark.parametrize(
    "name", ["..", "../x", "a/../../x", "/etc/passwd", "", " ", ".", "a\0b", "link/secret.csv", "link"]
)
def test_paths_outside_the_folder_are_refused(project: Project, name: str) -> None:
    secret = project.folder.parent / "elsewhere"
    secret.mkdir()
    (secret / "secret.csv").write_text("q1\n")
    (project.folder / "link").symlink_to(secret)
    with refused("E-STUDIO-041"):
        project.path(name)


def test_paths_inside_the_folder(project: Project) -> None:
    assert project.path("a/../b.csv") == project.folder / "b.csv"
    assert project.path("runs/b.csv") == project.folder / "runs" / "b.csv"


def test_files_are_those_of_the_folder_without_links_and_hidden_ones(project: Project) -> None:
    outside = project.folder.parent / "outside.csv"
    outside.write_text("q1,x\n")
    (project.folder / "link.csv").symlink_to(outside)
    for name in ("b.csv", ".hidden.csv", "runs/a.csv", ".git/c.csv", "d.txt"):
        (project.folder / name).parent.mkdir(exist_ok=True)
        (project.folder / name).write_text("q1,x\n")
    assert project.files(".csv") == ["b.csv", "runs/a.csv"]


def test_a_stamp_changes_with_the_files_that_are_shown(project: Project) -> None:
    before = project.stamp()
    (project.folder / "poses.csv").write_text("q1,x\n")
    written = project.stamp()
    assert before != written
    assert written == project.stamp()
    (project.folder / "poses.csv").write_text("q1,x\n1,2\n")
    assert project.stamp() != written


def test_tables_of_planned_poses_are_no_measurements(project: Project) -> None:
    for name, text in {
        "poses.csv": "pose,q1,q2,x,y,z\n1,0,0,1,1,1\n",
        "long.csv": "pose,q1,q2,x,y,z\n" + "1,0,0,1,1,1\n" * 50,
        "wire.csv": "pose,q1,q2,length\n1,0,0,1\n",
        "plan.csv": "plan,pose,q1,q2\ndefault,1,0,0\n",
        "degrees.csv": "pose,m1,m2,X\n1,0,0,1\n",
        "calibration/points.csv": "pose,q1,q2,x,y,z\n1,0,0,1,1,1\n",
        "calibration/results.json": "{}",
        "empty.csv": "",
    }.items():
        (project.folder / name).parent.mkdir(exist_ok=True)
        (project.folder / name).write_text(text)
    assert pose_files(project) == ["poses.csv", "long.csv", "wire.csv"]
    (project.folder / "robot.yaml").write_text(
        "robot: a.urdf\nsignals:\n  q: {columns: [m1, m2], unit: deg}\n"
    )
    assert "degrees.csv" in pose_files(project)


def test_choices_survive_and_a_damaged_file_is_no_obstacle(project: Project) -> None:
    choices = Choices.read(project.folder)
    assert choices.get("step", "Robot") == "Robot"
    choices.put("step", "Plan")
    assert Choices.read(project.folder).get("step", "Robot") == "Plan"
    assert Choices.read(project.folder).get("step", 3) == 3
    for damaged in ('{"step": ', "[1, 2]", "\xff", "x" * 200_000, json.dumps({"step": None})):
        (project.folder / ".studio.json").write_text(damaged)
        assert Choices.read(project.folder).get("step", "Robot") == "Robot"


@pytest.mark.parametrize("value", ["1e999", "-1", "11", "null", '"3"', "[3]"])
def test_numbers_that_no_field_takes_are_no_choices(project: Project, value: str) -> None:
    (project.folder / ".studio.json").write_text(f'{{"count": {value}}}')
    assert Choices.read(project.folder).number("count", 3.0, most=10) == 3.0


def test_pipes_are_no_files_of_the_folder(project: Project) -> None:
    """Nothing waits for what comes out of them, whatever they are called."""
    for name in (".studio.json", "robot.yaml", "poses.csv", "poses.yaml", "poses.html"):
        os.mkfifo(project.folder / name)
    assert project.files(".csv", ".yaml", ".json") == []
    assert Choices.read(project.folder).values == {} and pose_files(project) == []
    plan = project.folder / "poses.yaml"
    assert read_plan_file(plan) is None and plan_results(plan) == {} and not _says(plan, "poses")


def test_choices_that_nest_too_deep_are_ignored(project: Project) -> None:
    (project.folder / ".studio.json").write_text(90_000 * "[")
    assert Choices.read(project.folder).values == {}


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with refused("E-STUDIO-040"):
        Project.open(tmp_path / "nowhere")


def test_a_folder_is_held_once(tmp_path: Path) -> None:
    with (
        sole_studio(tmp_path),
        pytest.raises(InputError, match=f"process {os.getpid()}"),
        sole_studio(tmp_path),
    ):
        pass
    with sole_studio(tmp_path):
        pass


def test_holding_a_folder_writes_nothing_to_it(tmp_path: Path) -> None:
    """A folder from somebody else may have a link in any place."""
    with sole_studio(tmp_path):
        assert os.listdir(tmp_path) == []


def test_sentences_name_files_relative_to_the_folder(tmp_path: Path) -> None:
    folder = tmp_path / "arm"
    folder.mkdir()
    project = Project.open(folder)
    told = project.told(f"{folder}/robot.yaml line 19: see {folder}/sub/a.urdf, not {folder}2/b.urdf.")
    assert told == f"robot.yaml line 19: see sub/a.urdf, not {folder}2/b.urdf."
