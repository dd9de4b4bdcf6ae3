"""The accuracy map against drawn robots and against all derivatives; the scale of observed errors and its interval."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from flexcal.calibration.accuracy import error_sources, predicted_accuracy, random_poses_in
from flexcal.calibration.accuracy.source_contributions import source_of
from flexcal.calibration.measurement import (
    covariance_root,
    moving_parameters,
    predict_measurements,
    propagation,
)
from flexcal.calibration.verification import ErrorCovariance, ErrorScale, PredictionErrors, error_scale
from flexcal.data.poses import PoseSet
from flexcal.estimation import Parameter, Parameters
from flexcal.model.kinematics import joint_ranges, point_kinematics
from flexcal.model.parts import Bearings
from flexcal.model.robot import Posterior, RobotModel, unit_of

STD = {
    "offset": 3e-5, "misalignment_1": 3e-5, "misalignment_2": 3e-5, "length_x": 2e-5, "length_y": 2e-5, "length_z": 2e-5,
    "backlash": 5e-6, "gravity_compliance": 2e-8, "gravity_compliance_1": 2e-8, "gravity_compliance_2": 2e-8,
    "stiffness": 0.02, "mass": 0.3, "com_x": 5e-3, "com_y": 5e-3,
    "com_z": 5e-3, "x": 2e-5, "y": 2e-5, "z": 2e-5, "rx": 1e-5, "ry": 1e-5, "rz": 1e-5, "transmission_2_sin": 1e-5,
    "transmission_3_cos": 1e-5,
}  # fmt: skip


def placed(model: RobotModel) -> RobotModel:
    """With backlash, and an instrument that stands turned."""
    gaps = {f"{model.joint_names[i]}.backlash": 4e-5 for i in model.backlash_joints}
    place = {"x": 0.8, "y": -0.4, "z": 0.3, "rx": 0.3, "ry": -0.5, "rz": -1.2}
    return model.with_values(gaps | {f"station.tracker.{key}": value for key, value in place.items()})


def uncertain(model: RobotModel, rng: np.random.Generator, kinds: tuple[str, ...] = tuple(STD)) -> RobotModel:
    """With a correlated posterior of everything that moves its first point."""
    elastic = {model.joint_names[e.index] for e in model.elastic}
    backlash = {model.joint_names[i] for i in model.backlash_joints}
    names = []
    for name in model.values:
        owner, _, key = name.rpartition(".")
        if key not in kinds or owner.startswith("point."):
            continue
        if (key == "backlash" and owner not in backlash) or (
            key == "gravity_compliance" and owner in elastic
        ):
            continue
        names.append(name)
    parameters = Parameters(
        Parameter(n, unit_of(n), model.value(n), scale="log" if n.endswith(".stiffness") else "linear")
        for n in names
    )
    mixed = np.eye(len(names)) + 0.1 * rng.standard_normal((len(names), len(names)))
    root = np.array([STD[n.rpartition(".")[2]] for n in names])[:, None] * mixed
    return replace(model, posterior=Posterior(parameters, root @ root.T))


def seen(model: RobotModel, q: np.ndarray) -> PoseSet:
    size = len(q)
    return PoseSet(
        q=q, position=np.zeros((size, 3)), sigma=np.ones((size, 3)), torque=None, payload=None, target=np.full(size, "smr"),
        station=np.full(size, "tracker"), temperature=None, pose=np.arange(size),
    )  # fmt: skip


def poses_of(model: RobotModel, count: int, rng: np.random.Generator) -> np.ndarray:
    lower, upper = joint_ranges(model)
    return rng.uniform(lower, upper, (count, model.n))


@pytest.mark.parametrize("bearings", ["after", "before"])
def test_covariance_is_that_of_all_derivatives(
    tx90l: RobotModel, rng: np.random.Generator, bearings: Bearings
) -> None:
    tx90l = tx90l.with_bearings(bearings)
    model = uncertain(placed(tx90l), rng)
    q = poses_of(model, 300, rng)
    names = moving_parameters(model)
    assert {source_of(n) for n in names} == {
        "geometry",
        "backlash",
        "springs",
        "link masses",
        "payload",
        "instrument's place",
    }
    at = predict_measurements(model, seen(model, q), jacobians=True)
    roots = at.jacobian(names) @ covariance_root(model, names)
    position, fast = propagation(model).roots(q)
    exact, approximate = (np.linalg.eigvalsh(r @ np.swapaxes(r, 1, 2)) for r in (roots, fast))
    size = np.sqrt(exact[:, 2:])
    assert (np.abs(np.sqrt(exact) - np.sqrt(approximate)) / size).max() < 4e-3
    # of one robot in another payload, the springs are loaded otherwise
    other = propagation(model, payload=0.0).roots(q)[1]
    assert np.abs((other**2).sum(axis=(1, 2)) / (fast**2).sum(axis=(1, 2)) - 1).max() > 0.01
    assert np.abs(position - point_kinematics(model, q, jacobians=False).position).max() < 1e-12


def test_mean_and_quantile_are_those_of_drawn_robots(tx90l: RobotModel, rng: np.random.Generator) -> None:
    """Robots drawn from the posterior, each predicted in full: springs, flanks and all."""
    model = uncertain(placed(tx90l), rng)
    poses = seen(model, poses_of(model, 8, rng))
    found = predicted_accuracy(propagation(model), poses.q, threads=1)
    parameters = model.posterior.parameters
    root = np.linalg.cholesky(model.posterior.covariance)
    centre, here = parameters.coordinates(), predict_measurements(model, poses)
    drawn = np.empty((1500, 8))
    for distances in drawn:
        moved = centre + root @ rng.standard_normal(len(centre))
        values = {p.name: p.natural(x) for p, x in zip(parameters, moved, strict=True)}
        there = predict_measurements(model.with_values(values), poses, flank=here.rest.flank)
        distances[:] = np.linalg.norm(there.position - here.position, axis=1)
    np.testing.assert_allclose(found.mean, drawn.mean(axis=0), rtol=0.05)
    np.testing.assert_allclose(found.p95, np.quantile(drawn, 0.95, axis=0), rtol=0.09)


def test_sources_are_what_conditioning_takes_away(tx90l: RobotModel, rng: np.random.Generator) -> None:
    model = uncertain(placed(tx90l), rng)
    q = poses_of(model, 6, rng)
    shares = error_sources(propagation(model), q)
    names = moving_parameters(model)
    slopes = predict_measurements(model, seen(model, q), jacobians=True).jacobian(names)
    root = covariance_root(model, names)
    covariance = root @ root.T
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    whole = np.einsum("nip,pq,niq->n", slopes * scale, correlation, slopes * scale)
    for kind, share in shares.items():
        own = np.array([source_of(n) == kind for n in names])
        known = correlation[:, own] @ np.linalg.solve(correlation[np.ix_(own, own)], correlation[own])
        expected = np.einsum("nip,pq,niq->n", slopes * scale, known, slopes * scale) / whole
        np.testing.assert_allclose(share, expected, rtol=1e-6, err_msg=kind)


def test_random_poses_reach_into_the_box(tx90l: RobotModel, rng: np.random.Generator) -> None:
    model = uncertain(placed(tx90l), rng, ("offset",))
    reach = propagation(model)
    box = np.array([[0.4, -0.3, 0.2], [0.9, 0.3, 0.8]])
    q = random_poses_in(reach, 700, rng, box)
    at = point_kinematics(model, q, jacobians=False).position
    assert len(q) == 700 and (at > box[0]).all() and (at < box[1]).all()
    assert (at.min(axis=0) < box[0] + 0.05).all() and (at.max(axis=0) > box[1] - 0.05).all()
    with refused("E-CAL-003"):
        random_poses_in(reach, 10, rng, box[::-1])
    with refused("E-CAL-004", "5, 5, 5", "6, 6, 6"):
        random_poses_in(reach, 10, rng, np.array([[5.0] * 3, [6.0] * 3]))


def test_a_robot_of_which_nothing_was_estimated_has_no_map(tx90l: RobotModel) -> None:
    with refused("E-CAL-014", "tx90l"):
        propagation(tx90l)


def scale(
    errors: np.ndarray, roots: np.ndarray, ambiguous: np.ndarray, noise: np.ndarray | None
) -> ErrorScale:
    """Compare `errors` with roots and independent `noise` (N, 3), 1σ of a coordinate."""
    rms = np.sqrt((roots**2).sum(axis=(1, 2)))
    none = np.zeros(len(errors))
    independent = None if noise is None else noise[:, :, None] ** 2 * np.eye(3)
    verification = PredictionErrors(np.zeros_like(errors), errors, rms, none, ambiguous)
    return error_scale(verification, ErrorCovariance(roots, 0, independent))


@pytest.mark.statistical
@pytest.mark.parametrize("factor", [0.4, 1.0, 2.5])
def test_the_interval_of_the_scale_covers_it(factor: float, rng: np.random.Generator) -> None:
    """Errors that share few parameters, drawn with a known scale: counting poses as independent would cover far less."""
    mixing = rng.standard_normal((40, 3, 12)) * np.linspace(1.5, 0.5, 12)
    noise = np.full((40, 3), 0.8)
    inside, verdicts, naive, whole = 0, [], 0, 0
    predicted = (mixing**2).sum() + (noise**2).sum()
    ratio = np.sqrt((factor**2 * (mixing**2).sum() + (noise**2).sum()) / predicted)
    for _ in range(300):
        errors = factor * mixing @ rng.standard_normal(12) + noise * rng.standard_normal((40, 3))
        found = scale(errors, mixing, np.zeros(40, dtype=bool), noise)
        inside += found.low <= factor <= found.high
        whole += found.ratio_low <= ratio <= found.ratio_high
        naive += abs(found.factor / factor - 1) < 1.96 / np.sqrt(2 * 120)
        verdicts.append(found.verdict)
    assert 0.92 * 300 <= inside <= 0.99 * 300
    assert whole >= {0.4: 0.98, 1.0: 0.92, 2.5: 0.86}[factor] * 300
    assert naive < 0.7 * 300
    usual = {0.4: "cautious", 1.0: "right", 2.5: "optimistic"}[factor]
    assert verdicts.count(usual) > {0.4: 0.6, 1.0: 0.92, 2.5: 0.9}[factor] * 300


def test_probabilities_are_uniform_where_the_prediction_is_right(rng: np.random.Generator) -> None:
    mixing = rng.standard_normal((2000, 3, 400))
    noise = np.abs(rng.standard_normal((2000, 3))) * 10
    errors = mixing @ rng.standard_normal(400) + noise * rng.standard_normal((2000, 3))
    found = scale(errors, mixing, np.zeros(2000, dtype=bool), noise)
    shares = np.sort(found.probability)
    assert np.abs(shares - (np.arange(2000) + 0.5) / 2000).max() < 0.06
    assert found.inside == pytest.approx(0.95, abs=0.03)


def test_poses_with_an_uncertain_flank_are_left_out(rng: np.random.Generator) -> None:
    mixing, errors = rng.standard_normal((4, 3, 2)), rng.standard_normal((4, 3))
    errors[3] = 1e6
    unclear = np.array([False, False, False, True])
    assert scale(errors, mixing, unclear, None).factor < 100
    with refused("E-CAL-017", "1", "4"):
        scale(errors, mixing, np.arange(4) > 0, None)
