"""The friction of other robots of a model as prior of the next, from logs of a simulator of its own (`planar_arm`)."""

from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from planar_arm import TRUTH, URDF, swings, torque

from flexcal.jobs.dynamics import DynamicsIdentification, identify_robot_dynamics
from flexcal.jobs.fleet import review_fleet
from flexcal.jobs.fleet_prior import Member, pool_fleet

NAMES = ("j1.viscous", "j2.viscous", "j1.coulomb", "j2.coulomb")
SPREAD = 0.2


def logged(folder: Path, factors: np.ndarray, rng: np.random.Generator, seconds: float, noise: float) -> Path:
    """robot.yaml of a robot whose friction is `factors` (4,) times that of its type, with its log beside it."""
    folder.mkdir(parents=True)
    time, q, dq, ddq = swings(seconds, 200.0, 0.1, rng)
    more = dict(zip(NAMES, factors - 1, strict=True))
    acted = torque(q, dq, ddq) + noise * rng.standard_normal(q.shape)
    for k, joint in enumerate(("j1", "j2")):
        acted[:, k] += more[f"{joint}.viscous"] * TRUTH[f"{joint}.viscous"] * dq[:, k]
        acted[:, k] += more[f"{joint}.coulomb"] * TRUTH[f"{joint}.coulomb"] * np.sign(dq[:, k])
    (folder / "arm.urdf").write_text(URDF)
    robot = folder / "robot.yaml"
    robot.write_text("robot: arm.urdf\ndynamics: {friction: [viscous, coulomb, torque_offset]}\n")
    np.savetxt(
        folder / "log.csv",
        np.column_stack([time, q, acted]),
        fmt="%.9g",
        delimiter=",",
        header="t,q1,q2,tau1,tau2",
        comments="",
    )
    return robot


def identified(robot: Path, prior: Path | None = None) -> DynamicsIdentification:
    return identify_robot_dynamics(robot, [robot.parent / "log.csv"], prior=prior)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The prior file of four robots."""
    folder, rng, members = tmp_path_factory.mktemp("friction"), np.random.default_rng(1), []
    for k in range(4):
        robot = logged(folder / f"cell_{k}", np.exp(SPREAD * rng.standard_normal(4)), rng, 20.0, 0.5)
        identified(robot)
        members.append(Member.read(robot.parent.name, robot)["dynamics"])
    prior, _ = pool_fleet({"dynamics": members}, folder / "prior.yaml")
    assert prior.friction is not None
    assert set(prior.friction.names) == set(NAMES)
    assert set(prior.friction.scales) == {"log"}
    return folder / "prior.yaml"


def test_a_short_log_gains_from_the_others(fleet: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    factors = np.exp(SPREAD * rng.standard_normal(4))
    robot = logged(tmp_path / "next", factors, rng, 3.0, 4.0)
    alone, found = identified(robot).estimate, identified(robot, fleet)
    gained = [found.estimate.std(name) or np.inf for name in NAMES]
    assert all(s < (alone.std(name) or np.inf) for name, s in zip(NAMES, gained, strict=True))
    for name, factor, s in zip(NAMES, factors, gained, strict=True):
        assert abs(found.estimate.values[name] - factor * TRUTH[name]) < 3 * s
    assert found.pooled is not None
    assert not found.pooled.contradicted
    notes = found.document()["notes"]
    assert any("the friction of 4 other robots of the model" in note for note in notes)
    # the others would count twice in a prior of this robot
    assert Member.read("next", robot)["dynamics"].has_prior


def test_a_robot_with_other_friction_is_told_and_not_narrowed(fleet: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    robot = logged(tmp_path / "other", np.array([4.0, 1.0, 5.0, 1.0]), rng, 10.0, 0.5)
    alone, found = identified(robot), identified(robot, fleet)
    assert found.pooled is not None
    assert found.pooled.contradicted
    assert found.estimate.values == alone.estimate.values
    np.testing.assert_array_equal(found.estimate.covariance, alone.estimate.covariance)
    said = next(note for note in found.document()["notes"] if "does not fit this robot" in note)
    assert "j1.coulomb" in said
    assert "(p " in said
    assert "alone" in said
    assert not Member.read("other", robot)["dynamics"].has_prior


def test_other_friction_terms_are_said(fleet: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    robot = logged(tmp_path / "terms", np.ones(4), rng, 10.0, 0.5)
    robot.write_text("robot: arm.urdf\ndynamics: {friction: [viscous, coulomb]}\n")
    found = identified(robot, fleet)
    assert found.pooled is not None
    assert not found.pooled.used
    assert any(
        "is not used: it has the terms viscous, coulomb, torque_offset" in n
        for n in found.document()["notes"]
    )


def test_the_table_of_a_fleet_has_the_torque_errors_of_its_logs(tmp_path: Path) -> None:
    robot = logged(tmp_path / "cell", np.ones(4), np.random.default_rng(5), 10.0, 0.5)
    found = identify_robot_dynamics(
        robot, [robot.parent / "log.csv"], hold_out=0.3, out=robot.parent / "2026-03-01"
    )
    frame = review_fleet(tmp_path).gathered.table.frame
    rows = {row["name"]: row for row in frame.filter(kind="dynamics").to_dicts()}
    percent = found.document()["error_percent"]
    assert rows["torque_error.held_out"]["value"] == pytest.approx(percent["held_out"] / 100)
    assert rows["torque_error.fit"]["value"] == pytest.approx(percent["train"] / 100)
    assert rows["torque_error.fit"]["date"].isoformat() == "2026-03-01T00:00:00"
    assert rows["trusted"]["text"] is None


def next_robots(number: int, root: Path) -> tuple[list[tuple[bool, bool, float]], int]:
    """Of every parameter of six robots, after a fleet of eight: whether the interval holds the truth with the others and without them, and
    the standard deviation over that without them; and how many of the six are called another model.
    """
    folder, rng, members, rows, strangers = root / str(number), np.random.default_rng([7, number]), [], [], 0
    for k in range(8):
        robot = logged(folder / f"cell_{k}", np.exp(SPREAD * rng.standard_normal(4)), rng, 10.0, 1.0)
        identified(robot)
        members.append(Member.read(robot.parent.name, robot)["dynamics"])
    pool_fleet({"dynamics": members}, folder / "prior.yaml")
    for k in range(6):
        factors = np.exp(SPREAD * rng.standard_normal(4))
        robot = logged(folder / f"next_{k}", factors, rng, 12.0, 5.0)
        alone, found = identified(robot).estimate, identified(robot, folder / "prior.yaml")
        assert found.pooled is not None
        strangers += found.pooled.contradicted
        for name, factor in zip(NAMES, factors, strict=True):
            ends = [own.interval(name) or (-np.inf, np.inf) for own in (found.estimate, alone)]
            held, before = (low < factor * TRUTH[name] < high for low, high in ends)
            rows.append((held, before, (found.estimate.std(name) or np.nan) / (alone.std(name) or np.nan)))
    return rows, strangers


@pytest.mark.slow
def test_intervals_with_the_others_hold_the_truth(tmp_path: Path) -> None:
    """Four fleets of eight robots, and six further robots of each with noisy logs; one of a hundred is called another by chance."""
    fleets = over_seeds(next_robots, range(4), tmp_path)
    held, before, ratio = np.concatenate([rows for rows, _ in fleets]).T
    strangers = sum(count for _, count in fleets)
    said = f"{100 * np.mean(held):.1f} % of {len(held)} intervals ({100 * np.mean(before):.1f} % without the others)"
    print(f"{said}, {np.nanmedian(ratio):.2f} times as wide, {strangers} strangers of 24")
    assert np.mean(held) > 0.9
    assert np.nanmedian(ratio) < 0.8
    assert strangers <= 2
