"""The chain from the stepped plant through hold, spectra and response to stage 1, where nothing but arithmetic can go wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexcal.data.plans import MultisinePlan
from flexcal.data.recordings import Recording
from flexcal.elasticity.identification import MultiStart, fit_springs
from flexcal.elasticity.response_model import Tolerances
from flexcal.frequency.periodic import frequency_responses, local_polynomial_responses
from flexcal.jobs.experiments import frequency_plan
from flexcal.model.robot import RobotModel
from flexcal.model.robot.config import GeometryConfig
from flexcal.virtual_cell import CellConfig, FrictionConfig, LoopConfig, SensorConfig, VirtualCell, draw_truth

RATE_HZ = 1000.0


@pytest.fixture(scope="module")
def linear(tx90l: RobotModel, examples: Path) -> tuple[dict[str, float], MultisinePlan, list[Recording]]:
    """Recordings of a robot with known inertias, 1 kHz control, four plant steps a tick, no noise, friction or backlash."""
    config = CellConfig(
        controller=LoopConfig(substeps=4),
        sensors=SensorConfig(encoder_counts=0, torque_noise=0.0),
        friction=FrictionConfig(scale=0.0),
    )
    drawn = draw_truth(tx90l, config.spread, np.random.default_rng(31))
    truth = {name: value for name, value in drawn.items() if name.endswith(("stiffness", "damping"))}
    plan = frequency_plan(tx90l, examples / "tx90l" / "frequency_poses.csv", "default", 5)
    plan = replace(
        plan,
        rate_hz=RATE_HZ,
        realisations=3,
        signs=False,
        reference_amplitude=0.0,
        poses=plan.poses[[0, 1, 2, 5]],
    )
    free = tx90l.with_values({f"{joint}.viscous": 0.0 for joint in tx90l.joint_names})
    return truth, plan, list(VirtualCell(free.with_values(truth), config, 1).record(plan))


def late(recordings: list[Recording], samples: int) -> list[Recording]:
    """Positions logged `samples` ticks after the torque they belong to."""
    return [replace(r, q=np.roll(r.q, samples, axis=0)) for r in recordings]


@pytest.mark.parametrize("samples", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_nine_stiffnesses_and_the_delay(
    tx90l: RobotModel, linear: tuple[dict[str, float], MultisinePlan, list[Recording]], samples: int
) -> None:
    truth, plan, recordings = linear
    names = tx90l.joint_names[:3]
    responses = frequency_responses(plan, late(recordings, samples), joint_names=names)
    responses = [response.at_lines(slice(None, None, 12)) for response in responses]
    tight = replace(tx90l, config=replace(tx90l.config, geometry=GeometryConfig()))
    fit = fit_springs(
        tight, responses, inertias_known=True, tolerances=Tolerances.none(), rng=np.random.default_rng(0),
        search=MultiStart(agreement=1),
    ).estimate  # fmt: skip
    for name, value in truth.items():
        if name.endswith("stiffness"):
            assert abs(fit.values[name] / value - 1) < 0.005, (name, fit.values[name] / value - 1)
    for joint in names:
        assert abs(fit.values[f"{joint}.delay"] - samples / RATE_HZ) < 0.01 / RATE_HZ


@pytest.mark.slow
def test_nine_stiffnesses_from_one_realisation_that_starts_at_rest(
    tx90l: RobotModel, linear: tuple[dict[str, float], MultisinePlan, list[Recording]]
) -> None:
    """The local polynomial method on 4 × 48 s, transient and all, where averaging takes 4 × 144 s and drops half of it."""
    truth, plan, recordings = linear
    first = [r for r in recordings if r.label is not None and r.label.realisation == 0]
    short = replace(plan, realisations=1, settle_periods=0)
    responses = list(local_polynomial_responses(short, first, joint_names=tx90l.joint_names[:3]))
    tight = replace(tx90l, config=replace(tx90l.config, geometry=GeometryConfig()))
    fit = fit_springs(
        tight, responses, inertias_known=True, tolerances=Tolerances.none(), rng=np.random.default_rng(0)
    ).estimate
    errors = {n: abs(fit.values[n] / v - 1) for n, v in truth.items() if n.endswith("stiffness")}
    assert len(errors) == 9 and max(errors.values()) < 0.02, errors
