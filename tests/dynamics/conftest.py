"""The TX40 and its recording, and random motions."""

from pathlib import Path

import numpy as np
import pytest

from flexcal.dynamics import Motion
from flexcal.model import RobotModel


@pytest.fixture(scope="session")
def tx40(examples: Path) -> RobotModel:
    return RobotModel.from_yaml(examples / "tx40" / "robot.yaml", estimates=False)


@pytest.fixture
def motion(rng: np.random.Generator) -> Motion:
    """Forty random states of six joints, which no trajectory joins."""
    q, dq, ddq = rng.normal(size=(3, 40, 6))
    return Motion(np.arange(40.0), q, dq, ddq, np.zeros_like(q))
