"""Drives whose tangent stiffness differs from pose to pose, as their twist under gravity does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.identification import fit_springs
from flexcal.elasticity.response_model import Tolerances
from flexcal.elasticity.time_periodic import DriveTorque
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium


def still_plan(robot: RobotModel, poses: np.ndarray) -> MultisinePlan:
    """A plan whose reference motion stands still, and whose multisine is small."""
    assert robot.controller is not None
    lines = np.arange(13, 320, 8)
    return MultisinePlan(
        name="test", poses=poses, joints=(0, 1, 2), base_frequency_hz=0.25, lines=lines,
        amplitude=np.full((3, len(lines)), 0.05), periods=4, settle_periods=2, realisations=4, signs=True,
        reference_amplitude=0.0, reference_frequency_hz=2.125, kp=np.array(robot.controller.kp), kd=np.array(robot.controller.kd),
        rate_hz=4000.0, torque="held", seed=0,
    )  # fmt: skip


@pytest.mark.parametrize("true", [{}, {0: 0.2, 1: 0.1, 2: 0.3}], ids=["linear", "hardening"])
def test_hardening_is_found_and_not_invented(stiff, poses, synthesise, rng, true):
    """The stiffness is that at no load; twist and tangent are found by repetition here."""
    responses = []
    for q in poses["default"]:
        torque, tangent = static_equilibrium(stiff, q[None]).torque[0], {}
        for joint, share in true.items():
            name = f"joint_{joint + 1}.drive.stiffness"
            twist = 0.0
            for _ in range(200):
                twist = torque[joint] / stiff.value(name) / (1 + share * (twist / 1e-3) ** 2)
            tangent[name] = stiff.value(name) * (1 + 3 * share * (twist / 1e-3) ** 2)
        response = synthesise(stiff.with_values(tangent), q[None], noise=0.03, rng=rng, step=8)[0]
        responses.append(replace(response, pose=len(responses)))
    plan = still_plan(stiff, poses["default"])
    estimate = fit_springs(
        stiff, responses, rng=rng, inertias_known=True, tolerances=Tolerances.none(), plan=plan
    ).estimate
    assert any(name.endswith("hardening") for name in estimate.parameters.names) == bool(true)
    for joint in (1, 2):  # gravity does not twist joint 1
        name = f"joint_{joint + 1}.drive"
        assert estimate.values[f"{name}.stiffness"] == pytest.approx(
            stiff.value(f"{name}.stiffness"), rel=0.01
        )
        if true:
            assert estimate.values[f"{name}.hardening"] == pytest.approx(true[joint], abs=0.01)
            assert estimate.values[f"{name}.damping"] == pytest.approx(
                stiff.value(f"{name}.damping"), rel=0.15
            )


def test_the_equivalent_stiffness_of_a_random_twist(rng: np.random.Generator) -> None:
    """Bussgang's gain of the curve, by the regression of drawn torques on drawn twists."""
    stiffness, share, mean, size = 2e5, 0.2, 8e-4, 3e-4
    loaded = DriveTorque(
        slow=np.array([[stiffness * mean * (1 + share * (mean / 1e-3) ** 2)]]),
        lines=np.array([[stiffness * size * np.sqrt(2)]]),
        stiffness=np.array([stiffness]),
    )
    twist = mean + size * rng.standard_normal(400_000)
    torque = stiffness * twist * (1 + share * (twist / 1e-3) ** 2)
    gain = np.cov(twist, torque)[0, 1] / np.var(twist)
    found = loaded.hardened(np.array([stiffness]), np.array([share]))
    assert found.ratio[0, 0] == pytest.approx(gain / stiffness, rel=5e-3)
    ends = [loaded.hardened(np.array([stiffness]), np.array([share + s])).ratio[0, 0] for s in (-1e-4, 1e-4)]
    assert found.by_hardening[0, 0] == pytest.approx((ends[1] - ends[0]) / 2e-4, rel=1e-5)
    ends = [
        loaded.hardened(np.array([stiffness * (1 + s)]), np.array([share])).ratio[0, 0] for s in (-1e-4, 1e-4)
    ]
    assert found.by_stiffness[0, 0] == pytest.approx((ends[1] - ends[0]) / 2e-4, rel=1e-5)
