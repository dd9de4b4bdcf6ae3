"""The stiffness of other robots of a model as prior of the next, of arms whose responses are in closed form."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from elastic_scara import STIFFNESS, scara, write_scara
from over_seeds import over_seeds
from refusals import refused

from flexcal import RobotModel, identify_stiffness
from flexcal.elasticity.identification import MultiStart
from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.jobs.fleet_prior import (
    Member,
    ModelPrior,
    PooledValues,
    pool_fleet,
    pool_springs,
    read_model_prior,
)
from flexcal.jobs.stiffness import StiffnessIdentification

NAMES = ("j1.drive.stiffness", "j2.drive.stiffness")
SEARCH = MultiStart(starts=1, agreement=1)


def identified(
    model: RobotModel,
    rng: np.random.Generator,
    noise: float,
    prior: ModelPrior | None = None,
    softer: float = 1.0,
) -> tuple[np.ndarray, StiffnessIdentification]:
    """True stiffnesses of a robot, and what its responses tell."""
    robot = scara(rng, spread=0.015, softer=softer)
    found = identify_stiffness(model, robot.measured(rng, noise), search=SEARCH, prior=prior)
    return np.array(robot.stiffness), found


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    return RobotModel.from_yaml(write_scara(tmp_path_factory.mktemp("scara")))


@pytest.fixture(scope="module")
def pooled(model: RobotModel) -> PooledValues:
    rng = np.random.default_rng(4)
    found = [identified(model, rng, 0.05) for _ in range(4)]
    members = [Member(f"cell_{k}", model, own[1].estimate, block="stiffness") for k, own in enumerate(found)]
    own = pool_springs(members)
    np.testing.assert_allclose(
        np.log(own.mean), np.mean(np.log([truth for truth, _ in found]), axis=0), atol=0.02
    )
    return own


def test_the_next_robot_is_told_by_the_others(model: RobotModel, pooled: PooledValues) -> None:
    assert pooled.names == NAMES
    assert np.all((pooled.std > 0.01) & (pooled.std < 0.06))
    prior = ModelPrior(None, pooled, None, "prior.yaml")
    # the same noise: alone, and with the others
    alone = identified(model, np.random.default_rng(5), 1.0)[1]
    truth, found = identified(model, np.random.default_rng(5), 1.0, prior)
    for name, value in zip(NAMES, truth, strict=True):
        before, after = alone.estimate.std(name), found.estimate.std(name)
        assert after is not None
        assert before is None or after < 0.8 * before
        assert abs(found.estimate.values[name] - value) < 3 * after
    assert found.pooled is not None
    assert found.pooled.used
    assert any(
        "nothing in these measurements contradicts it" in remark or "do not tell" in remark
        for remark in found.remarks
    )


def test_a_robot_of_another_batch_is_told_and_not_narrowed(model: RobotModel, pooled: PooledValues) -> None:
    prior = ModelPrior(None, pooled, None, "prior.yaml")
    alone = identified(model, np.random.default_rng(6), 0.3, softer=0.6)[1]
    _, found = identified(model, np.random.default_rng(6), 0.3, prior, softer=0.6)
    assert found.pooled is not None
    assert found.pooled.contradicted
    assert not found.pooled.used
    assert found.estimate.values == alone.estimate.values
    said = next(remark for remark in found.remarks if "does not fit this robot" in remark)
    assert "p < 5e-4" in said
    assert "j1.drive.stiffness" in said
    assert "from these measurements alone" in said


def test_robots_that_are_no_population_are_left_out_in_words(
    model: RobotModel, pooled: PooledValues, tmp_path: Path
) -> None:
    estimate = synthetic(np.random.default_rng(0), 0.05, 0.02, np.zeros(2))
    members = [Member(f"cell_{k}", model, estimate, block="stiffness") for k in range(3)]
    odd = replace(
        members[0], name="odd", estimate=replace(estimate, provenance={"option.bearings": "before"})
    )
    friction = Member("cell_0", model, replace(estimate, provenance={}), block="dynamics")
    prior, remarks = pool_fleet({"stiffness": members, "dynamics": [friction]}, tmp_path / "prior.yaml")
    assert prior.friction is None
    assert any("without friction: the dynamics of 1 robots" in remark for remark in remarks)
    assert any("without geometry, because 0 robots are calibrated" in remark for remark in remarks)
    again = read_model_prior(tmp_path / "prior.yaml", model)
    assert again.geometry is None
    assert again.stiffness is not None
    assert prior.stiffness is not None
    np.testing.assert_array_equal(again.stiffness.mean, prior.stiffness.mean)
    np.testing.assert_array_equal(again.stiffness.std, prior.stiffness.std)
    with refused("E-PRIOR-014", "cell_0", "odd", "before"):
        pool_springs([*members, odd])
    with refused("E-PRIOR-013", "stiffness", "2"):
        pool_springs(members[:2])


def synthetic(rng: np.random.Generator, spread: float, noise: float, heavier: np.ndarray) -> Estimate:
    """Estimate of responses that tell each stiffness over the inertia that it carries, and no mass: the springs of a robot whose links are
    `heavier` (of the logarithm) than CAD, which is known to 5 %.
    """
    true = np.log(STIFFNESS) + spread * rng.standard_normal(2)
    across = np.array([[0.9, 0.4], [0.1, 0.9]])
    tolerance = 0.05
    # log k - B log(m / CAD) is measured; with the prior of the masses their joint posterior is
    read = true - across @ heavier + noise * rng.standard_normal(2)
    covariance = np.block(
        [
            [noise**2 * np.eye(2) + tolerance**2 * across @ across.T, tolerance**2 * across],
            [tolerance**2 * across.T, tolerance**2 * np.eye(2)],
        ]
    )
    springs = [
        Parameter(n, "N m/rad", float(np.exp(v)), prior_std=1.5, prior_mean=float(c), scale="log")
        for n, v, c in zip(NAMES, read, (14000.0, 6000.0), strict=True)
    ]
    masses = [
        Parameter(n, "kg", v, prior_std=tolerance, scale="log")
        for n, v in (("inner.mass", 9.0), ("outer.mass", 5.0))
    ]
    return Estimate(
        parameters=Parameters([*springs, *masses]),
        covariance=covariance,
        rank=4,
        dropped=(),
        identifiable=(True,) * 4,
        cost=0.0,
        chi2=0.0,
        degrees_of_freedom=1000,
        status="converged",
        message="",
        iterations=1,
    )


TYPE_SPREAD = 0.03


def of_one_fleet(seed: int, model: RobotModel, robots: int) -> tuple[np.ndarray, np.ndarray]:
    """Whether the prior of a fleet whose masses are all wrong alike holds the next robot (2,), and its standard deviations (2,)."""
    rng = np.random.default_rng([robots, seed])
    heavier = 0.05 * rng.standard_normal(2)
    members = [
        Member(str(k), model, synthetic(rng, TYPE_SPREAD, 0.02, heavier), block="stiffness")
        for k in range(robots)
    ]
    own = pool_springs(members)
    truth = np.log(STIFFNESS) + TYPE_SPREAD * rng.standard_normal(2)
    return np.abs(truth - np.log(own.mean)) < 1.96 * own.std, own.std


@pytest.mark.slow
@pytest.mark.parametrize("robots", [3, 6, 30])
def test_intervals_hold_the_next_robot_though_all_have_the_same_wrong_mass(
    model: RobotModel, robots: int
) -> None:
    """The error of the CAD is common to all robots and does not average out: its half-width bounds what the prior may claim."""
    held, widths = zip(*over_seeds(of_one_fleet, range(200), model, robots), strict=True)
    share = float(np.mean(held))
    print(f"{robots} robots: {100 * share:.1f} % of 400 intervals, 1 sigma {100 * np.mean(widths):.1f} %")
    assert 0.9 < share <= 1.0
    # no sharper than spread and common error of the masses
    assert np.mean(widths) > np.hypot(TYPE_SPREAD, 0.04)
