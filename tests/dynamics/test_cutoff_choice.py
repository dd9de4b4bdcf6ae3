"""The proposed cut-off, on a seven-axis arm that Pinocchio simulates: noise between 1 and 30 Hz in positions and torques."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import polars as pl
import pytest
from over_seeds import over_seeds

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import assemble_regression
from flexcal.dynamics.signals import JointLog, Motion
from flexcal.jobs.logs import choose_preprocessing
from flexcal.model.robot import RobotModel

RATE, SECONDS, TOP_HZ = 1000, 20, 3.0
TURNS = [
    "0 0 0",
    "1.5708 0 3.1416",
    "1.5708 0 3.1416",
    "1.5708 0 0",
    "-1.5708 3.1416 0",
    "1.5708 0 0",
    "-1.5708 3.1416 0",
]
LENGTHS = [0.15, 0.19, 0.21, 0.19, 0.21, 0.19, 0.08]
MASSES = [4.0, 5.0, 4.0, 3.0, 2.0, 1.5, 0.5]
LINK = """<link name="l{0}"><inertial><origin xyz="{1} 0.03 0.06"/><mass value="{2}"/><inertia ixx="{3}" ixy="0" ixz="0"
 iyy="{4}" iyz="0" izz="{5}"/></inertial></link><joint name="j{0}" type="revolute"><parent link="{6}"/><child link="l{0}"/>
 <origin xyz="0 0 {7}" rpy="{8}"/><axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" effort="300" velocity="3"/></joint>"""


class Arm:
    """The true robot, 20 % beside its URDF, and a motion whose speed falls off above 0.5 Hz."""

    def __init__(self, folder: Path, seed: int) -> None:
        parents = ["base", *(f"l{k}" for k in range(1, 7))]
        links = [
            LINK.format(
                k + 1, 0.02 * (-1) ** k, m, 0.01 * m, 0.012 * m, 0.006 * m, parents[k], LENGTHS[k], TURNS[k]
            )
            for k, m in enumerate(MASSES)
        ]
        self.urdf = folder / "arm.urdf"
        self.urdf.write_text(f'<robot name="arm"><link name="base"/>{"".join(links)}</robot>')
        self.model = pin.buildModelFromUrdf(str(self.urdf))
        self.data = self.model.createData()
        self.rng = np.random.default_rng(seed)
        for k in range(1, 8):
            body, scale = self.model.inertias[k], self.rng.uniform(0.8, 1.2)
            lever = body.lever + self.rng.uniform(-0.02, 0.02, 3)
            self.model.inertias[k] = pin.Inertia(scale * body.mass, lever, scale * body.inertia)
        self.drives = self.rng.uniform([[0.05], [1], [1], [-1]], [[0.3], [5], [4], [1]], (4, 7))
        self.line = 2 * np.pi * 0.05 * np.arange(1, round(TOP_HZ / 0.05))
        speed = self.rng.normal(size=(7, len(self.line))) / (1 + (self.line / np.pi) ** 1.5)
        self.amplitude = 0.15 * speed / np.abs(speed / self.line).max(axis=1, keepdims=True) / self.line
        self.new_motion()

    def new_motion(self) -> None:
        self.phase = self.rng.uniform(0, 2 * np.pi, self.amplitude.shape)

    def states(self, time: np.ndarray) -> list[np.ndarray]:
        angle = time[:, None, None] * self.line + self.phase
        waves = (np.cos(angle), -np.sin(angle), -np.cos(angle))
        return [np.sum(self.amplitude * self.line**k * wave, axis=2) for k, wave in enumerate(waves)]

    def torque(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        rigid = [pin.rnea(self.model, self.data, *state) for state in zip(q, dq, ddq, strict=True)]
        inertia, viscous, coulomb, offset = self.drives
        return np.array(rigid) + inertia * ddq + viscous * dq + coulomb * np.sign(dq) + offset

    def band(self, samples: int) -> np.ndarray:
        """Noise (N, 7) between 1 and 30 Hz of unit size."""
        lines = np.fft.rfft(self.rng.normal(size=(samples, 7)), axis=0)
        frequency = np.fft.rfftfreq(samples, 1 / RATE)
        lines[(frequency < 1) | (frequency > 30)] = 0
        noise = np.fft.irfft(lines, samples, axis=0)
        return noise / noise.std(axis=0)

    def write(self, folder: Path, position_noise: float, torque_noise: float) -> RobotModel:
        time = np.arange(RATE * SECONDS) / RATE
        states = self.states(time)
        torque = self.torque(*states)
        q = states[0] + position_noise * self.band(len(time))
        torque = torque + torque_noise * torque.std(axis=0) * self.band(len(time))
        names = ["t", *(f"q{k}" for k in range(1, 8)), *(f"tau{k}" for k in range(1, 8))]
        pl.DataFrame(np.column_stack([time, q, torque]), schema=names).write_parquet(folder / "log.parquet")
        (folder / "robot.yaml").write_text("robot: arm.urdf\ngravity: [0, 0, -9.81]\n")
        return RobotModel.from_yaml(folder / "robot.yaml")

    def truth(self) -> dict[str, float]:
        """Of the parameters, by their names."""
        tensor = ("Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
        found = {}
        for k in range(7):
            body = self.model.inertias[k + 1].toDynamicParameters()
            keys = ("mass", "mc_x", "mc_y", "mc_z", *tensor)
            found |= {f"l{k + 1}.{key}": float(value) for key, value in zip(keys, body, strict=True)}
            keys = ("rotor_inertia", "viscous", "coulomb", "torque_offset")
            found |= {f"j{k + 1}.{key}": float(v) for key, v in zip(keys, self.drives[:, k], strict=True)}
        return found

    def error(
        self, model: RobotModel, folder: Path, cutoff_hz: float, decimation: Decimation
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Of the torques of another motion, whose states are known exactly; errors (k,) of the base parameters, and their standard
        deviations."""
        observation = Observation(model, CLASSIC)
        base = BaseParameters.of(observation)
        log = JointLog.read(folder / "log.parquet", model, cutoff_hz, folder)
        estimate = weighted_least_squares(assemble_regression(observation, base, [log], decimation))
        found = estimate.parameters.coordinates()
        time = 0.02 * np.arange(1000)
        q, dq, ddq = self.states(time)
        torque = self.torque(q, dq, ddq)
        columns = observation.columns(Motion(time, q, dq, ddq, torque))
        pairs = zip(columns, observation.column_indices, strict=True)
        predicted = np.transpose([found[members] @ own for own, members in pairs])
        truth = self.truth()
        beside = base.identifiability.regrouping @ (
            found - [truth[name] for name in base.identifiability.names]
        )
        std = np.sqrt(np.diag(estimate.covariance))[list(base.identifiability.kept)]
        return float(np.linalg.norm(predicted - torque) / np.linalg.norm(torque)), beside, std


def ratios(seed: int, folder: Path, position_noise: float, torque_noise: float) -> tuple[float, float]:
    """Errors with the default, over the smallest of a scan over three octaves: of torques, and of base parameters by the standard
    deviations of the best fit."""
    (folder := folder / str(seed)).mkdir()
    arm = Arm(folder, seed)
    model = arm.write(folder, position_noise, torque_noise)
    treatment = choose_preprocessing(model, [folder / "log.parquet"])
    arm.new_motion()
    own = arm.error(model, folder, treatment.cutoff_hz, treatment.decimation)
    others = [
        arm.error(model, folder, cutoff, Decimation.near(RATE / (4 * cutoff)))
        for cutoff in (3.0, 4.0, 5.0, 6.5, 8.5, 11.0, 15.0, 25.0)
    ]
    best = min(others, key=lambda error: error[0])
    distances = [float(np.linalg.norm(beside / best[2])) for _, beside, _ in (own, *others)]
    print(f"{treatment.cutoff_hz} Hz: {own[0] / best[0]:.2f}, {distances[0] / min(distances[1:]):.2f}")
    return own[0] / best[0], distances[0] / min(distances[1:])


def test_positions_whose_noise_looks_like_motion(tmp_path: Path) -> None:
    assert ratios(1, tmp_path, 1e-4, 0.05)[0] < 1.15


@pytest.mark.slow
@pytest.mark.parametrize(
    ("position_noise", "torque_noise"),
    [(1e-4, 0.05), (5e-4, 0.1), (2e-5, 0.03), (2e-5, 0.2), (5e-6, 0.03)],
)
def test_torques_and_base_parameters_of_many_logs(
    tmp_path: Path, position_noise: float, torque_noise: float
) -> None:
    """On average, since the best cut-off of one log is partly luck: one for all logs with that noise is up to 1.21 times as bad."""
    seeds = (2, 3, 4, 40, 41, 42, 43)
    each = np.array(over_seeds(ratios, seeds, tmp_path, position_noise, torque_noise))
    assert np.all(each.mean(axis=0) < 1.15)
    assert np.all(each < 1.4)


def test_positions_without_noise_keep_the_cutoff_of_their_spectrum(tmp_path: Path) -> None:
    treatment = choose_preprocessing(Arm(tmp_path, 5).write(tmp_path, 0.0, 0.1), [tmp_path / "log.parquet"])
    assert treatment.choice is None and treatment.cutoff_hz > 20
