"""What every test may ask for: the example robots, and random numbers from a fixed seed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from flexcal.model import RobotModel

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture(scope="session")
def examples() -> Path:
    """The folder of the examples; read only: tests that write copy what they need to `tmp_path`."""
    return ROOT / "examples"


@pytest.fixture(scope="session")
def tx90l(examples: Path) -> RobotModel:
    """The nominal TX90L (elastic axes 1-3, payload, backlash), without estimates."""
    from flexcal.model import RobotModel

    return RobotModel.from_yaml(examples / "tx90l" / "robot.yaml", estimates=False)


@pytest.fixture(scope="session")
def ur5(examples: Path) -> RobotModel:
    """The nominal UR5 (all joints rigid), without estimates."""
    from flexcal.model import RobotModel

    return RobotModel.from_yaml(examples / "ur5_tracker" / "robot.yaml", estimates=False)


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers, the same in every run and independent of the order of the tests."""
    return np.random.default_rng(20150917)
