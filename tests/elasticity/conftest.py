"""Frequency responses with a known truth, made from the analytic transfer matrix and noise that acts like friction, on the torque."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import RobotModel, spring_names
from flexcal.model.vibration import linearise, transfer_matrix

Synthesis = Callable[..., list[FrequencyResponse]]
VISCOUS = np.array([1.6, 1.3, 1.8])


@pytest.fixture(scope="session")
def poses(examples: Path) -> dict[str, np.ndarray]:
    """Poses (P, 6) rad of the plans of the example."""
    with (examples / "tx90l" / "frequency_poses.csv").open() as file:
        rows = list(csv.DictReader(file))
    return {
        plan: np.deg2rad([[float(r[f"q{i}_deg"]) for i in range(1, 7)] for r in rows if r["plan"] == plan])
        for plan in ("default", "paper")
    }


@pytest.fixture(scope="session")
def stiff(tx90l: RobotModel) -> RobotModel:
    """The TX90L with no backlash declared, and with torques that are those measured."""
    geometry = replace(tx90l.config.geometry, backlash=())
    prior = replace(tx90l.config.prior, torque_constant=0.0)
    return replace(tx90l, config=replace(tx90l.config, geometry=geometry, prior=prior))


@pytest.fixture(scope="session")
def shaken() -> Callable[[FrequencyResponse, float], FrequencyResponse]:
    """A response with a resonance at 45 Hz of something that shakes along with joint 2, like a cell's base or a loose payload."""

    def make(response: FrequencyResponse, share: float) -> FrequencyResponse:
        ratio = response.frequencies_hz / 45.0
        extra = np.ones((len(ratio), 3, 3), complex)
        extra[:, 1, 1] += share * ratio**2 / (1 - ratio**2 + 0.06j * ratio)
        return replace(response, response=response.response * extra)

    return make


@pytest.fixture(scope="session")
def synthesise() -> Synthesis:
    """Responses of a true robot in some poses; `noise` is the relative standard deviation of the torque, drawn with `rng`."""

    def make(
        truth: RobotModel,
        poses: np.ndarray,
        *,
        noise: float,
        rng: np.random.Generator | None = None,
        payload: float | None = None,
        step: int = 4,
    ) -> list[FrequencyResponse]:
        frequencies = np.arange(13, 320, step) * 0.25
        s = 2j * np.pi * frequencies
        result = []
        for k, q in enumerate(poses):
            moved = replace(
                truth,
                drives=replace(
                    truth.drives,
                    viscous=truth.drives.viscous * np.append(VISCOUS, np.ones(3)) * (1 + 0.03 * k),
                ),
            )
            response = transfer_matrix(linearise(moved, q, payload), frequencies).response
            response = response * np.exp(-s[:, None] * truth.drives.delay[:3])[:, None, :]
            one = noise**2 * response @ np.swapaxes(response, 1, 2).conj()
            covariance = np.zeros((len(s), 9, 9), dtype=complex)
            for c in range(3):
                covariance[:, 3 * c : 3 * c + 3, 3 * c : 3 * c + 3] = one
            if rng is not None:
                draw = rng.standard_normal((2, len(s), 3, 3)) / np.sqrt(2)
                response = response + noise * response @ (draw[0] + 1j * draw[1])
            result.append(
                FrequencyResponse(
                    frequencies_hz=frequencies,
                    response=response,
                    covariance=covariance,
                    noise_covariance=covariance,
                    degrees_of_freedom=45.0,
                    realisations=response[None],
                    joints=truth.joint_names[:3],
                    q_mean=q,
                    payload=payload,
                    pose=k,
                    sample_time=1 / 4000,
                )
            )
        return result

    return make


@pytest.fixture(scope="session")
def drawn() -> Callable[..., RobotModel]:
    """A true robot: springs ±15 % (damping ±30 %), and with `inertias` the rest as far off as the robot's prior says."""

    def draw(model: RobotModel, rng: np.random.Generator, *, inertias: bool) -> RobotModel:
        values = {}
        for name in spring_names(model):
            size = 0.15 if name.endswith(".stiffness") else 0.3
            values[name] = model.value(name) * np.exp(size * rng.standard_normal())
        for joint in model.joint_names[:3]:
            name = f"{joint}.rotor_inertia"
            values[name] = model.value(name) * np.exp(model.prior.rotor_inertia * rng.standard_normal())
            values[f"{joint}.delay"] = 1e-4 * rng.standard_normal()
        if inertias:
            for joint in model.joints:
                mass = f"{joint.link}.mass"
                values[mass] = model.value(mass) * np.exp(model.prior.mass * rng.standard_normal())
                for key in "xyz":
                    com = f"{joint.link}.com_{key}"
                    values[com] = model.value(com) + model.prior.com * rng.standard_normal()
        return model.with_values(values)

    return draw
