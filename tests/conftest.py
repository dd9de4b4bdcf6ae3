"""What every test may ask for: the example robots, and random numbers from a fixed seed."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel
    from flexcal.report.layout import FigureBlock

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

ROOT = Path(__file__).parent.parent
LINK = """<link name="{0}"><inertial><origin xyz="0.1 -0.2 0.05"/><mass value="{1}"/>
  <inertia ixx="0.4" ixy="0.05" ixz="-0.03" iyy="0.5" iyz="0.02" izz="0.3"/></inertial></link>"""
JOINT = """<joint name="to_{1}" type="{2}"><parent link="{0}"/><child link="{1}"/><origin xyz="0.3 -0.1 0.2" rpy="0.3 -0.5 0.9"/>
  <axis xyz="{3}"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>"""
BRANCHES = [
    ("base", "trunk", "revolute", "0 0 1"),
    ("trunk", "left", "revolute", "0 1 0"),
    ("left", "slider", "prismatic", "1 2 -1"),
    ("slider", "hand", "revolute", "1 -1 3"),
    ("trunk", "right", "prismatic", "0 0 1"),
    ("right", "finger", "revolute", "-1 0 0"),
]


@pytest.fixture(scope="session", autouse=True)
def no_waiting_for_the_disk() -> Iterator[None]:
    """What a test writes need not outlast a power failure: `fsync` returns at once, in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda handle: None)
        yield


@pytest.fixture(scope="session", autouse=True)
def locks_of_the_tests(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Locks are files of a cache folder that goes with the tests, in their processes too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session", autouse=True)
def figures_are_plotly_s() -> Iterator[None]:
    """Each figure of the pages that this process writes is what Plotly makes of it, which knows each property: flexcal does not ask it."""
    from flexcal.report.layout import rendering

    written = rendering.figure_json

    def checked(block: FigureBlock) -> str:
        plotly = json.loads(str(block.figure.plotly().to_json()))
        del plotly["layout"]["template"]
        text = written(block)
        ours = json.loads(text)
        assert {"data": ours["data"], "layout": ours["layout"]} == plotly
        return text

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rendering, "figure_json", checked)
        yield


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture(scope="session")
def examples() -> Path:
    """The folder of the examples; read only: tests that write copy what they need to `tmp_path`."""
    return ROOT / "examples"


@pytest.fixture(scope="module")
def dask_cluster() -> Iterator[Any]:
    """A Dask scheduler with two worker processes, which are started again where they are killed.

    It ends with the module: at rest it takes a tenth of a processor.
    """
    import distributed

    started: Any = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0")
    with started:
        yield started


@pytest.fixture
def dask_address(dask_cluster: Any) -> str:
    """Its address, as `--on` takes it."""
    return dask_cluster.scheduler_address.replace("tcp://", "dask://")


@pytest.fixture(scope="session")
def tx90l(examples: Path) -> RobotModel:
    """The nominal TX90L (elastic axes 1-3, payload, backlash), without estimates."""
    from flexcal.model.robot import RobotModel

    return RobotModel.from_yaml(examples / "tx90l" / "robot.yaml", estimates=False)


@pytest.fixture(scope="session")
def ur5(examples: Path) -> RobotModel:
    """The nominal UR5 (all joints rigid), without estimates."""
    from flexcal.model.robot import RobotModel

    return RobotModel.from_yaml(examples / "ur5_tracker" / "robot.yaml", estimates=False)


@pytest.fixture(scope="session")
def tree(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    """Two branches on a trunk, with slides and skew axes, under tilted gravity."""
    from flexcal.model.robot import RobotModel

    folder = tmp_path_factory.mktemp("tree")
    links = [LINK.format(child, 1.5 + i) for i, (_, child, *_) in enumerate(BRANCHES)]
    parts = ['<link name="base"/>', *links, *(JOINT.format(*branch) for branch in BRANCHES)]
    (folder / "tree.urdf").write_text(f'<robot name="tree">{"".join(parts)}</robot>')
    (folder / "robot.yaml").write_text("robot: tree.urdf\ngravity: [1.0, -2.0, -9.0]\n")
    return RobotModel.from_yaml(folder / "robot.yaml")


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers, the same in every run and independent of the order of the tests."""
    return np.random.default_rng(20150917)
