"""Bearing axes from frequency responses alone: found where robot.yaml says nothing, contradicted where it is wrong."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flexcal.elasticity.identification import fit_springs
from flexcal.elasticity.response_model import Tolerances
from flexcal.model.parts import Bearings
from flexcal.model.robot import RobotModel, spring_names


@pytest.mark.parametrize("true", ["before", "after"])
def test_undeclared_axes_are_those_of_the_robot(
    stiff: RobotModel,
    poses: dict[str, np.ndarray],
    synthesise: Callable,
    drawn: Callable,
    rng: np.random.Generator,
    true: Bearings,
) -> None:
    """And with them every stiffness is met."""
    truth = drawn(stiff, rng, inertias=False).with_bearings(true)
    responses = synthesise(truth, poses["default"][:4], noise=0.01, rng=rng, step=16)
    found = fit_springs(stiff, responses, rng=rng, inertias_known=True, tolerances=Tolerances.none())
    assert found.bearings is not None and found.bearings.taken == true
    assert found.robot(stiff).bearings == true
    names = [name for name in spring_names(stiff) if name.endswith(".stiffness")]
    errors = [abs(np.log(found.estimate.values[name] / truth.value(name))) for name in names]
    assert max(errors) < 0.1


@pytest.mark.slow
def test_axes_declared_wrongly_are_contradicted(
    stiff: RobotModel,
    poses: dict[str, np.ndarray],
    synthesise: Callable,
    drawn: Callable,
    rng: np.random.Generator,
) -> None:
    """A stiffness would else be stated with an interval that it misses by far: by 0.17 to 6 in its logarithm over five robots."""
    truth = drawn(stiff, rng, inertias=True).with_bearings("before")
    responses = synthesise(truth, poses["default"], noise=0.05, rng=rng, step=8)
    found = fit_springs(stiff.with_bearings("after"), responses, rng=rng)
    assert found.bearings is not None and found.bearings.contradicted and found.bearings.taken == "after"
    missed = [
        abs(found.estimate.values[name] - truth.value(name)) > 3 * std
        for name in spring_names(stiff)
        if name.endswith(".stiffness") and (std := found.estimate.std(name)) is not None
    ]
    assert any(missed)
