"""The TX40 and its recording, and random motions."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel


@pytest.fixture(scope="session")
def tx40(examples: Path) -> RobotModel:
    return RobotModel.from_yaml(examples / "tx40" / "robot.yaml", estimates=False)


@pytest.fixture
def motion(rng: np.random.Generator) -> Motion:
    """Forty random states of six joints, which no trajectory joins."""
    q, dq, ddq = rng.normal(size=(3, 40, 6))
    return Motion(np.arange(40.0), q, dq, ddq, np.zeros_like(q))


@pytest.fixture(scope="session")
def sines() -> Callable[[int, float], Motion]:
    """sines(samples, rate_hz): six joints on sums of sines, with exact derivatives and no torque."""

    def make(samples: int, rate_hz: float) -> Motion:
        rng = np.random.default_rng(7)
        time = np.arange(samples) / rate_hz
        rate = 2 * np.pi * 0.1 * np.array([1, 2, 3, 5, 7])
        size, phase = rng.normal(size=(5, 6)), rng.uniform(0, 2 * np.pi, (5, 6))
        angle = time[:, None, None] * rate[:, None] + phase
        q = np.sum(size * np.sin(angle), axis=1)
        dq = np.sum(size * rate[:, None] * np.cos(angle), axis=1)
        ddq = -np.sum(size * rate[:, None] ** 2 * np.sin(angle), axis=1)
        return Motion(time, q, dq, ddq, np.zeros_like(q))

    return make


@pytest.fixture(scope="session")
def swing(sines: Callable[[int, float], Motion]) -> Motion:
    """Ten seconds at 200 Hz."""
    return sines(2000, 200.0)


@pytest.fixture(scope="session")
def observation(tx40: RobotModel) -> Observation:
    """The TX40 with the classic drive terms."""
    return Observation(tx40, CLASSIC)


@pytest.fixture(scope="session")
def base(observation: Observation) -> BaseParameters:
    return BaseParameters.of(observation)


@pytest.fixture(scope="session")
def truth(observation: Observation) -> np.ndarray:
    """Parameters (p,) that differ from CAD, and are all different from zero."""
    return observation.values() + np.random.default_rng(5).uniform(0.1, 1.0, len(observation.names))
