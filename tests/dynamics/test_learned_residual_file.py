"""The file of a learned residual: plain numbers that belong to one estimate, and that predict without scikit-learn."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recovery import driven
from refusals import refused
from two_links import true_values, two_links

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import assemble_regression
from flexcal.dynamics.residual import (
    LEARNED,
    GaussianProcess,
    LearnedMotor,
    LearnedResidual,
    read_learned_residual,
    write_learned_residual,
)
from flexcal.dynamics.signals import Motion
from flexcal.estimation import Estimate
from flexcal.files.formats import write_estimates

SHARES = np.array([[1.0, 0.0], [0.5, 1.0]])


@pytest.fixture
def estimate(tmp_path: Path, rng: np.random.Generator) -> Estimate:
    arm = Observation(two_links(tmp_path), CLASSIC)
    q, dq, ddq = rng.normal(size=(3, 60, 2))
    motion = driven(arm, Motion(np.arange(60.0), q, dq, ddq, np.zeros_like(q)), true_values(arm))
    noisy = replace(motion, torque=motion.torque + rng.normal(size=q.shape))
    return weighted_least_squares(assemble_regression(arm, BaseParameters.of(arm), [noisy], Decimation(1)))


@pytest.fixture
def learned(rng: np.random.Generator) -> LearnedResidual:
    """A shoulder that learned, an elbow that did not."""
    inputs = rng.normal(size=(30, 3))
    shoulder = GaussianProcess(inputs, rng.normal(size=30), np.array([0.5, 1.0, 8.0]), 4.0, 0.1)
    elbow = GaussianProcess(inputs, np.zeros(30), np.ones(3), 0.0, 0.09)
    return LearnedResidual(
        (LearnedMotor("shoulder", shoulder, 1.5), LearnedMotor("elbow", elbow, 1.0)), SHARES
    )


def test_joints_feel_what_was_learned_of_the_motors(
    learned: LearnedResidual, rng: np.random.Generator
) -> None:
    """The elbow's motor turns by half the shoulder's angle too, so that the shoulder feels half of its torque; the motors err apart."""
    q, dq, predicted = rng.normal(size=(3, 5, 2))
    mean, std = learned.torque(q, dq, predicted)
    on_motors = np.stack([predicted[:, 0] - 0.5 * predicted[:, 1], predicted[:, 1]], axis=1)
    own, spread = learned.motors[0].process.predict(np.stack([q[:, 0], dq[:, 0], on_motors[:, 0]], axis=1))
    np.testing.assert_allclose(mean, np.stack([own, np.zeros(5)], axis=1), atol=1e-14)
    np.testing.assert_allclose(std[:, 0], np.sqrt((1.5 * spread) ** 2 + (0.5 * 0.3) ** 2))
    np.testing.assert_allclose(std[:, 1], 0.3)
    for wrong in ((q[:, :1], dq, predicted), (q, dq[:4], predicted), (q[0], dq[0], predicted[0])):
        with refused("E-DYN-028", "2"):
            learned.torque(*wrong)


def test_what_was_written_predicts_the_same_without_scikit_learn(
    learned: LearnedResidual, estimate: Estimate, tmp_path: Path
) -> None:
    write_estimates(tmp_path / "estimates.yaml", "dynamics", estimate)
    write_learned_residual(tmp_path / LEARNED, learned, tmp_path / "estimates.yaml")
    program = (
        "import sys; sys.modules['sklearn'] = None; import numpy as np; from flexcal import read_learned_residual\n"
        "found = read_learned_residual('learned_residual.npz', 'estimates.yaml')\n"
        "print(found.learned, *np.ravel(found.torque(*np.full((3, 1, 2), 0.3))).tolist())"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    names, numbers = run.stdout.rsplit(")", 1)
    assert names == "('shoulder',"
    np.testing.assert_array_equal(
        [float(v) for v in numbers.split()], np.ravel(learned.torque(*np.full((3, 1, 2), 0.3)))
    )


def test_it_belongs_to_one_estimate(learned: LearnedResidual, estimate: Estimate, tmp_path: Path) -> None:
    estimates, file = tmp_path / "estimates.yaml", tmp_path / LEARNED
    write_estimates(estimates, "dynamics", estimate)
    write_learned_residual(file, learned, estimates)
    moved = estimate.parameters.with_coordinates(1.01 * estimate.parameters.coordinates())
    write_estimates(estimates, "dynamics", replace(estimate, parameters=moved))
    with refused("E-DYN-030", "estimates.yaml", "flexcal identify"):
        read_learned_residual(file, estimates)
    for content in (b"", b"nonsense", b"PK\x03\x04"):
        file.write_bytes(content)
        with refused("E-FILE-003", "learned_residual.npz"):
            read_learned_residual(file, estimates)
    np.savez(file, allow_pickle=False, names=np.array(["shoulder"]))
    with refused("E-FILE-004"):
        read_learned_residual(file, estimates)
    file.unlink()
    with refused("E-FILE-003", "No such file"):
        read_learned_residual(file, estimates)
