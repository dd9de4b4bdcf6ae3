"""Bearing axes from frequency responses alone: found where robot.yaml says nothing, contradicted where it is wrong."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import norm

from flexcal.elasticity.identification import SpringFit, fit_springs
from flexcal.elasticity.response_model import Tolerances
from flexcal.jobs.stiffness.bearing_axes import response_bearings_remarks
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


def test_intervals_include_the_axes_that_may_be_the_true_ones(
    stiff: RobotModel,
    poses: dict[str, np.ndarray],
    synthesise: Callable,
    drawn: Callable,
    rng: np.random.Generator,
) -> None:
    """Mean square of draws from the fits with both axes about the one taken, the other as often as chance makes it fit worse by as much."""
    truth = drawn(stiff, rng, inertias=False).with_bearings("before")
    responses = synthesise(truth, poses["default"][:2], noise=0.5, rng=rng, step=16)

    def fitted(model: RobotModel) -> SpringFit:
        generator = np.random.default_rng(0)
        return fit_springs(model, responses, rng=generator, inertias_known=True, tolerances=Tolerances.none())

    found = fitted(stiff)
    assert found.bearings is not None and found.bearings.undecided
    taken: Bearings = found.bearings.taken
    others: Bearings = "before" if taken == "after" else "after"
    own, other = (fitted(stiff.with_bearings(bearings)).estimate for bearings in (taken, others))
    share = norm.cdf(-abs(found.bearings.statistic))
    assert share > 0.01
    count = 400_000
    from_other = rng.random(count) < share
    for name in spring_names(stiff):
        k, j = own.parameters.index(name), other.parameters.index(name)
        difference = np.log(other.values[name] / own.values[name])
        std = np.where(from_other, np.sqrt(other.covariance[j, j]), np.sqrt(own.covariance[k, k]))
        drawn_values = from_other * difference + std * rng.standard_normal(count)
        variance = found.estimate.covariance[k, k]
        assert variance == pytest.approx(np.mean(drawn_values**2), rel=0.05)
        assert found.estimate.values[name] == pytest.approx(own.values[name], rel=1e-3)
    remark = response_bearings_remarks(found.bearings)[0]
    assert "equally well within chance" in remark


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
