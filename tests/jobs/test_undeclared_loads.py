"""What carries or loads an arm without a word in robot.yaml is named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from two_links import GAINS, swings, two_links

from flexcal.data.recordings import Decimation
from flexcal.dynamics.diagnostics import GravityRatio, weight_shares
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.friction.terms import Cables
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import assemble_regression
from flexcal.dynamics.signals import Motion
from flexcal.jobs.dynamics.remarks import undeclared_spring_remarks
from flexcal.report.checks import check_weight_shares


def moved(arm: Observation) -> Motion:
    """Forty seconds, with noise of 0.1 N m."""
    motion = swings(arm, np.zeros(10), 3)
    noise = 0.1 * np.random.default_rng(1).normal(size=motion.q.shape)
    return replace(motion, torque=GAINS * motion.torque + noise)


def shoulder_weight(q: np.ndarray) -> np.ndarray:
    """Gravity torque (N,), N m, from the potential energy of two point masses, 6 kg and 3 kg."""
    both = q[:, 0] + q[:, 1]
    upper = 6 * (-0.2 * np.cos(q[:, 0]) - 0.02 * np.sin(q[:, 0]))
    lower = 3 * (-0.4 * np.cos(q[:, 0]) - 0.2 * np.cos(both) - 0.02 * np.sin(both))
    return 9.81 * (upper + lower)


def fitted(arm: Observation, motion: Motion) -> tuple:
    data = assemble_regression(arm, BaseParameters.of(arm), [motion], Decimation(1))
    return data, weighted_least_squares(data)


def shares(arm: Observation, motion: Motion) -> dict[str, GravityRatio]:
    return weight_shares(*fitted(arm, motion))


def test_the_weight_that_something_else_carries_is_named(tmp_path: Path) -> None:
    arm = Observation(two_links(tmp_path), CLASSIC)
    motion = moved(arm)
    plain = shares(arm, motion)
    assert set(plain) == {"shoulder", "elbow"} and not any(share.unlike for share in plain.values())
    for carried in (1.0, 0.8):
        torque = motion.torque - carried * np.column_stack([shoulder_weight(motion.q), 0 * motion.time])
        found = shares(arm, replace(motion, torque=torque))
        assert found["shoulder"].unlike and not found["elbow"].unlike
        # what the lower link weighs on the shoulder is told from its elbow, whose torque nothing carries
        assert found["shoulder"].share == pytest.approx(1.0 - carried, abs=0.2)
    check = check_weight_shares({"shoulder": {"share": -0.01, "low": -0.02, "high": 0.0}})
    assert check.status == "care" and "on shoulder" in check.answer and "joint_springs" in check.answer


def test_torques_in_another_unit_are_the_first_thing_to_check(tmp_path: Path) -> None:
    """Currents show too little weight on every joint, a balancer on one: only there springs come first, and the torques are right."""
    arm = Observation(two_links(tmp_path), CLASSIC)
    motion = moved(arm)

    def answer(torque: np.ndarray) -> str:
        found = shares(arm, replace(motion, torque=torque))
        unlike = {name: asdict(share) for name, share in found.items() if share.unlike}
        return check_weight_shares(unlike, len(found)).answer if unlike else ""

    currents = answer(motion.torque / 12.0)
    assert "on shoulder 0.08" in currents and "on elbow 0.08" in currents
    assert "Check first whether the torques are in another unit (currents in A" in currents
    assert "torques and masses are then wrong by that factor" in currents
    assert currents.index("unit") < currents.index("something else carries the arm")
    assert "all the same" not in currents
    carried = answer(motion.torque - np.column_stack([shoulder_weight(motion.q), 0 * motion.time]))
    assert (
        "Either something else carries the arm" in carried and "torques are predicted all the same" in carried
    )
    assert "Or the torques of shoulder are in another unit" in carried
    assert answer(motion.torque) == ""


def springs(arm: Observation, motion: Motion) -> Sequence[str]:
    return list(undeclared_spring_remarks(*fitted(arm, motion)))


def test_a_spring_that_is_not_declared_is_named(tmp_path: Path) -> None:
    arm = Observation(two_links(tmp_path), (*CLASSIC, Cables()))
    motion = moved(arm)
    assert springs(arm, motion) == []
    sprung = replace(motion, torque=motion.torque + [40.0, 0.0] * (motion.q - 0.5))
    (sentence,) = springs(arm, sprung)
    assert "of shoulder" in sentence and "joint_springs: [{joint: shoulder}]" in sentence
    stiffness, rest = (
        sentence.split("parallel to it of ")[1].split(" N m/rad")[0],
        sentence.split("near ")[1].split()[0],
    )
    assert float(stiffness) == pytest.approx(40.0, rel=0.01) and float(rest) == pytest.approx(0.5, abs=0.02)


def test_a_declared_spring_has_one_column_and_a_wrong_one_is_corrected(tmp_path: Path) -> None:
    free = tmp_path / "free"
    free.mkdir()
    arm = Observation(
        two_links(free, "dynamics: {joint_springs: [{joint: shoulder}]}\n"), (*CLASSIC, Cables())
    )
    assert "elbow.cable_stiffness" in arm.names and "shoulder.cable_stiffness" not in arm.names
    wrong = tmp_path / "wrong"
    wrong.mkdir()
    text = "dynamics: {joint_springs: [{joint: shoulder, stiffness: -40, rest: 0.5}]}\n"
    arm = Observation(two_links(wrong, text), (*CLASSIC, Cables()))
    motion = moved(arm)
    sprung = replace(
        motion, torque=motion.torque + [80.0, 0.0] * (motion.q - 0.5)
    )  # as if -40 were taken off 40
    (sentence,) = springs(arm, sprung)
    assert "beside the -40 N m/rad that robot.yaml declares" in sentence
