import numpy as np
import pytest
from refusals import refused

from flexcal.design.optimality import TraceOptimal
from flexcal.design.poses import GeometricTolerances, base_sensitivity, geometry_jacobian, pose_sensitivity
from flexcal.design.poses.feasibility import tool_error_weight
from flexcal.design.poses.selection import tool_error
from flexcal.design.scene import MeasuringSetup, TrackerNoise
from flexcal.estimation import Parameter, Parameters, Sensitivity
from flexcal.model.kinematics import point_kinematics
from flexcal.model.statics import static_equilibrium


def _measured(model, q):
    rest = static_equilibrium(model, q, elastic=False)
    return point_kinematics(model, q, rest.deflection, jacobians=False).position


def test_jacobian_against_differences(tx90l, rng):
    q = rng.uniform(-2, 2, (6, 6))
    names, jacobian = geometry_jacobian(tx90l, q)
    assert len(names) == 47
    for column, name in enumerate(names):
        if name.startswith("station."):
            np.testing.assert_array_equal(
                jacobian[:, :, column], np.tile(np.eye(3)["xyz".index(name[-1])], (6, 1))
            )
            continue
        step = 1e-6
        high, low = (_measured(tx90l.with_values({name: s * step}), q) for s in (1, -1))
        if name.endswith(
            "backlash"
        ):  # a half gap cannot be negative in the cell, but its derivative is the same
            high, low, step = _measured(tx90l.with_values({name: step}), q), _measured(tx90l, q), step / 2
        np.testing.assert_allclose(jacobian[:, :, column], (high - low) / (2 * step), atol=2e-6, err_msg=name)


def test_29_of_47_directions_with_a_clear_gap(tx90l, rng):
    full = pose_sensitivity(tx90l, rng.uniform(-2, 2, (300, 6)))
    base = base_sensitivity(full)
    found = base.identifiability
    assert (len(found.names), found.rank, len(found.dropped)) == (47, 29, 18)
    assert found.gap > 6
    assert {"joint_2.backlash", "joint_3.backlash"} <= set(found.kept_names)
    singular = np.linalg.svd(full.jacobian.reshape(-1, 47) * full.parameters.prior_std(), compute_uv=False)
    assert np.sum(singular > 1e-9 * singular[0]) == 29
    assert all(entry.absorbed_by for entry in found.dropped)


def test_one_flank_hides_both_backlashes(tx90l, rng):
    q = np.column_stack(
        [
            rng.uniform(-2, 2, 200),
            rng.uniform(0.3, 1.2, 200),
            rng.uniform(0.1, 0.4, 200),
            rng.uniform(-2, 2, (200, 3)),
        ]
    )
    assert base_sensitivity(pose_sensitivity(tx90l, q)).identifiability.rank == 27


def test_noise_and_scale(tx90l, ur5, rng):
    q = rng.uniform(-2, 2, (5, 6))
    full = pose_sensitivity(tx90l, q, MeasuringSetup(noise=TrackerNoise(20e-6, 0.0)))
    np.testing.assert_allclose(full.jacobian[:, 0, 0], 1 / 20e-6)
    distance = np.linalg.norm(point_kinematics(tx90l, q).position - [2.5, 0, 1], axis=1)
    np.testing.assert_allclose(pose_sensitivity(tx90l, q).jacobian[:, 0, 0], 1 / (15e-6 + 6e-6 * distance))
    away = pose_sensitivity(ur5, q).jacobian[:, 0, 0]
    np.testing.assert_allclose(away, 1 / (15e-6 + 6e-6 * 2 * ur5.reach))
    tolerances = GeometricTolerances(length=1e-3, angle=2e-3)
    stds = dict(
        zip(
            full.parameters.names,
            pose_sensitivity(tx90l, q, tolerances=tolerances).parameters.prior_std(),
            strict=True,
        )
    )
    assert (stds["joint_1.offset"], stds["tool.length_x"], stds["joint_2.backlash"]) == pytest.approx(
        (2e-3, 1e-3, 2e-3)
    )


def test_base_parameters_predict_what_all_47_with_their_tolerances_do(tx90l, rng):
    full = pose_sensitivity(tx90l, rng.uniform(-2, 2, (60, 6)))
    base = base_sensitivity(full)
    working = rng.uniform(-2, 2, (30, 6))
    weight = tool_error_weight(base.columns(geometry_jacobian(tx90l, working)[1]))
    rows = geometry_jacobian(tx90l, working)[1].reshape(-1, 47)
    for chosen in (np.arange(12), np.arange(40)):
        factor = full.factor(chosen)
        spread = np.linalg.solve(factor.T, rows.T)
        assert tool_error(base, weight, chosen) == pytest.approx(np.sqrt(np.sum(spread**2) / 30), rel=1e-6)
        direct = base.sensitivity.covariance(chosen)
        assert TraceOptimal(weight, "c").trace(np.linalg.inv(direct)) == pytest.approx(
            np.sum(weight * direct)
        )


def test_a_parameter_without_tolerance_is_named():
    parameters = Parameters([Parameter("a", "m", 0.0, prior_std=1.0), Parameter("b", "m", 0.0)])
    with refused("E-DESIGN-025", "b"):
        base_sensitivity(Sensitivity(np.ones((2, 3, 2)), parameters, np.zeros((2, 2))))
