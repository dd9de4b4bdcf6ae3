"""What goes there comes back, for whatever Hypothesis thinks of: commands and tool poses, estimates and their files."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from flexcal.compensation import motor_commands
from flexcal.data.poses import ToolTargets
from flexcal.estimation import Parameter, Parameters, Problem, solve
from flexcal.files.formats import read_estimates, write_estimates
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest


@given(
    q=st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6),
    offsets=st.lists(st.floats(-5e-3, 5e-3), min_size=6, max_size=6),
    lengths=st.lists(st.floats(-3e-3, 3e-3), min_size=6, max_size=6),
    compliance=st.floats(0.0, 1e-5),
)
@settings(max_examples=40, deadline=None)
def test_a_compensated_command_brings_the_real_tool_where_the_nominal_one_was(
    ur5: RobotModel, q: list[float], offsets: list[float], lengths: list[float], compliance: float
) -> None:
    off = {f"{name}.offset": value for name, value in zip(ur5.joint_names, offsets, strict=True)}
    off |= {f"{name}.length_x": value for name, value in zip(ur5.joint_names, lengths, strict=True)}
    off["shoulder_lift_joint.gravity_compliance"] = compliance
    real, name = ur5.with_values(off), np.array([next(iter(ur5.points))])
    targets = ToolTargets(np.arange(1), name, np.array([q]))
    found = motor_commands(real, ur5, targets)
    if not found.reached[0]:
        assert found.reason[0]
    assume(bool(found.reached[0]))  # Hypothesis complains where hardly any is
    desired = tool_at_rest(ur5, targets.q, None, name).kinematics
    there = tool_at_rest(real, found.q, None, name).kinematics
    np.testing.assert_allclose(there.position, desired.position, atol=1e-8)
    np.testing.assert_allclose(there.orientation, desired.orientation, atol=1e-8)


numbers = st.floats(-1e3, 1e3).filter(lambda value: value == 0 or abs(value) > 1e-9)


@given(
    values=st.lists(numbers, min_size=2, max_size=5),
    rows=st.integers(6, 12),
    seed=st.integers(0, 2**31),
)
@settings(max_examples=30, deadline=None)
def test_an_estimate_is_read_as_it_was_written(values: list[float], rows: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix, truth = rng.normal(size=(rows, len(values))), np.array(values)
    data = matrix @ truth + rng.normal(size=rows)
    names = [f"joint_{k + 1}.offset" for k in range(len(values))]
    parameters = Parameters([Parameter(name, "rad", 0.0) for name in names])
    estimate = solve(Problem(parameters, lambda x: (matrix @ x - data, matrix)))
    expected = np.linalg.inv(matrix.T @ matrix)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "estimates.yaml"
        write_estimates(file, "calibration", estimate)
        again = read_estimates(file)["calibration"]
    assert again.values == estimate.values and again.parameters.names == tuple(names)
    np.testing.assert_array_equal(again.covariance, estimate.covariance)
    ratio = np.diag(again.covariance) / np.diag(expected)
    assert np.ptp(ratio) < 1e-6 * ratio.max()  # the same but for the noise level
    for name in names:
        assert again.interval(name) == pytest.approx(estimate.interval(name))
