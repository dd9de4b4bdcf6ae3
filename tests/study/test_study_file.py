"""What a study file declares, and how it is refused."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from small_study import EXAMPLES, UR5, write_study

from flexcal.design.scene import CollisionChecker
from flexcal.jobs.study import read_study
from flexcal.jobs.study.two_stage_runs import TwoStageRuns
from flexcal.model.robot import RobotModel

DATA_SET = {
    "kind": "calibrate",
    "seeds": None,
    "grid": None,
    "options": None,
    "poses": [str(UR5 / "random.csv")],
}
"""Keys of a study of measured poses, for `write_study`."""


def test_every_combination_has_a_row_for_every_seed(tmp_path: Path) -> None:
    draw = {"count": 3, "options": {"cell.sensors.tracker_noise_m": {"log_uniform": [1e-6, 1e-4]}}}
    rows = read_study(write_study(tmp_path, draw=draw, seeds={"first": 5, "count": 4})).rows
    assert len(rows) == len({row.key for row in rows}) == 2 * 3 * 4
    assert {row.seed for row in rows} == {5, 6, 7, 8} and {row.options["poses"] for row in rows} == {10, 12}
    noise = {row.options["cell.sensors.tracker_noise_m"] for row in rows}
    assert len(noise) == 3 and all(1e-6 <= value <= 1e-4 for value in noise)


def test_more_seeds_draws_or_values_leave_the_rows_that_there_were(tmp_path: Path) -> None:
    draw = {
        "count": 2,
        "seed": 3,
        "options": {"cell.spread.angle": {"uniform": [0, 1e-3]}, "plan": {"choice": ["random", "designed"]}},
    }
    before = {row.key for row in read_study(write_study(tmp_path, draw=draw)).rows}
    more = {**draw, "count": 4}
    after = {
        row.key
        for row in read_study(
            write_study(tmp_path, draw=more, seeds={"count": 3}, grid={"poses": [12, 9, 10]})
        ).rows
    }
    assert before < after


def test_groups_and_draws_of_a_data_set(tmp_path: Path) -> None:
    def resamples(**resampling: object) -> list[str]:
        return [
            row.resample for row in read_study(write_study(tmp_path, **DATA_SET, resampling=resampling)).rows
        ]

    assert resamples(bootstrap=3) == ["all", "bootstrap 1", "bootstrap 2", "bootstrap 3"]
    assert sorted(resamples(jackknife=3)) == ["all", *(f"without group {k}" for k in (1, 2, 3))]
    assert len(resamples(leave_one_out="pose")) == 1 + 20
    with refused("E-STUDY-011", "station"):
        resamples(leave_one_out="station")
    with refused("E-STUDY-026", "'q1'", "20 poses"):
        resamples(leave_one_out="q1")
    assert len(resamples(jackknife=20)) == 1 + 20
    with refused("E-STUDY-027", "jackknife: 21", "at most 20"):
        resamples(jackknife=21)
    assert len(read_study(write_study(tmp_path, **DATA_SET)).rows) == 1


@pytest.mark.parametrize(
    ("changes", "code", "names"),
    [
        ({"seed": 3}, "E-YAML-001", ("line 7", "seed")),
        ({"seeds": {"count": 10**11}}, "E-STUDY-014", ("200000000000 tasks",)),
        ({"draw": {"count": 10**9, "options": {"plan": {"choice": ["random"]}}}}, "E-STUDY-014", ("4000000000",)),
        (
            {"draw": {"count": 2, "options": {"cell.spread.angle": {"uniform": [0.002, 0.001]}}}},
            "E-STUDY-028",
            ("uniform: [0.001, 0.002]",),
        ),
        (
            {"draw": {"count": 2, "options": {"cell.spread.angle": {"log_uniform": [0.002, 0.001]}}}},
            "E-STUDY-028",
            ("log_uniform: [0.001, 0.002]",),
        ),
        ({"kind": "calibrat"}, "E-YAML-034", ("line 1", "calibrat")),
        ({"options": {"terms": ["kinematic"], "losss": "cauchy"}}, "E-YAML-001", ("line 6", "losss")),
        ({"options": {"cell.sensors.noise": 1}}, "E-YAML-001", ("line 4", "noise")),
        ({"grid": {"poses": [10, "many"]}}, "E-YAML-028", ("line 6", "many")),
        ({"grid": {"poses": [10, 1]}}, "E-STUDY-008", ("line 6",)),
        ({"grid": {"poses": []}}, "E-STUDY-015", ("line 6", "poses")),
        ({"options": {"poses": 9}}, "E-STUDY-016", ("poses",)),
        ({"options": {"terms": ["kinematik"]}}, "E-RUN-011", ("line", "kinematik")),
        ({"options": {"cell.sensors.tracker_noise_m": 0.03}}, "E-CELL-035", ("line 4", "0.03 m,", "3e-05 for 0.03 mm")),
        ({"seeds": {"count": 0}}, "E-STUDY-001", ("line 3",)),
        ({"seeds": {"count": 10_000_000}}, "E-STUDY-014", ("20000000",)),
        ({"draw": {"count": 2, "options": {"poses": {"uniform": [10, 20]}}}, "grid": None}, "E-YAML-028", ("line 8",)),
        ({"draw": {"count": 0, "options": {}}}, "E-STUDY-004", ()),
        ({"draw": {"count": 1, "options": {"poses": {"choice": []}}}, "grid": None}, "E-STUDY-003", ()),
        ({"draw": {"count": 1, "options": {"cell.spread.angle": {"log_uniform": [0, 1]}}}}, "E-STUDY-002", ()),
    ],
)  # fmt: skip
def test_what_is_refused(changes: dict, code: str, names: tuple[str, ...], tmp_path: Path) -> None:
    with refused(code, *names):
        read_study(write_study(tmp_path, **changes))


@pytest.mark.parametrize(
    ("resampling", "code"),
    [
        ({}, "E-STUDY-006"),
        ({"bootstrap": 3, "jackknife": 2}, "E-STUDY-006"),
        ({"bootstrap": -3}, "E-STUDY-005"),
        ({"jackknife": 1}, "E-STUDY-007"),
        ({"bootstrap": 10**9}, "E-STUDY-029"),
    ],
)
def test_resampling_that_is_refused(resampling: dict, code: str, tmp_path: Path) -> None:
    with refused(code):
        read_study(write_study(tmp_path, **DATA_SET, resampling=resampling))


def test_a_two_stage_study_takes_the_robots_own_files(tmp_path: Path) -> None:
    robot = EXAMPLES / "tx90l" / "robot.yaml"
    grid = {"cell.mismatch.repeatability": [0.0, 3e-5], "plan": ["default", "quick"]}
    plan = read_study(write_study(tmp_path, kind="two_stage", robot=str(robot), grid=grid, options=None))
    assert len(plan.rows) == 8
    assert {
        f"input.{name}" for name in ("robot.yaml", "tx90l.urdf", "cell.yaml", "frequency_poses.csv")
    } < set(plan.tasks.origin)


def test_a_two_stage_study_takes_obstacles_and_meshes(tmp_path: Path) -> None:
    """Written elsewhere, its files make the robot with the same collision shapes."""
    folder = tmp_path / "here" / "cell" / "robots"
    shutil.copytree(EXAMPLES / "tx90l", folder)
    for name, end in (("package://cell/part.stl", "part"), ("../part.stl", "other")):
        shape = f'<collision><origin xyz="3 0 1"/><geometry><mesh filename="{name}"/></geometry></collision>'
        (folder / f"{end}.urdf").write_text(f'<robot name="wall"><link name="wall">{shape}</link></robot>')
    corners = np.eye(4, 3)
    vertices = [
        "".join(f"vertex {x} {y} {z}\n" for x, y, z in np.delete(corners, k, axis=0)) for k in range(4)
    ]
    facets = [f"facet normal 0 0 0\nouter loop\n{text}endloop\nendfacet\n" for text in vertices]
    (folder.parent / "part.stl").write_text(f"solid part\n{''.join(facets)}endsolid part\n")
    with (folder / "robot.yaml").open("a") as file:
        file.write("obstacles: [part.urdf, other.urdf]\n")
    path = write_study(tmp_path, kind="two_stage", robot=str(folder / "robot.yaml"), grid=None, options=None)
    tasks = read_study(path).tasks
    assert isinstance(tasks, TwoStageRuns)
    shapes = [shape.name for shape in CollisionChecker(RobotModel.from_yaml(folder / "robot.yaml")).shapes]
    shutil.rmtree(tmp_path / "here")
    for name, content in tasks.contents.items():
        there = tmp_path / "there" / name
        there.parent.mkdir(parents=True, exist_ok=True)
        there.write_bytes(content)
    copied = RobotModel.from_yaml(tmp_path / "there" / tasks.robot)
    assert [shape.name for shape in CollisionChecker(copied).shapes] == shapes
