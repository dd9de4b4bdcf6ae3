"""The prior of a robot model from calibrated robots, of an arm that was simulated without the library's kinematics."""

import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import refused
from simulated_fleet import (
    Fleet,
    SimulatedRobot,
    points,
    random_poses,
    turned,
    write_poses,
    write_robot,
)

from flexcal import RobotModel, calibrate, fit_geometry
from flexcal.calibration.diagnostics import EnoughPoses
from flexcal.calibration.fit import FleetPrior, GeometricFit, base_errors
from flexcal.calibration.measurement import predict_measurements
from flexcal.cli.main import main
from flexcal.data.poses import PosePool, PoseSet
from flexcal.design.poses import choose_poses, pose_candidates
from flexcal.design.scene import MeasuringSetup, TrackerNoise
from flexcal.estimation import Parameters
from flexcal.files.formats import write_estimates
from flexcal.jobs.calibration import calibrate_robot
from flexcal.jobs.fleet import review_fleet, write_prior
from flexcal.jobs.fleet_prior import (
    FLEET,
    Member,
    alike,
    pool_fleet,
    pooled_prior,
    read_model_prior,
)

NOISE = 5e-5


@dataclass(frozen=True, eq=False)
class Pooled:
    """A fleet, its nominal model, the calibrated members and their prior."""

    fleet: Fleet
    model: RobotModel
    members: Sequence[Member]
    prior: FleetPrior


def poses_of(q: np.ndarray, position: np.ndarray) -> PoseSet:
    """Measured points as the library has them."""
    size = len(q)
    return PoseSet(
        q=q,
        position=position,
        sigma=np.full((size, 3), NOISE),
        torque=None,
        payload=None,
        target=np.full(size, "ball"),
        station=np.full(size, "tracker"),
        temperature=None,
        pose=np.arange(size),
    )


def fitted(
    model: RobotModel,
    robot: SimulatedRobot,
    count: int,
    rng: np.random.Generator,
    prior: FleetPrior | None,
    terms: Sequence[str] = ("kinematic",),
) -> GeometricFit:
    q = random_poses(count, rng)
    return fit_geometry(
        model, poses_of(q, robot.measured(q, NOISE, rng)), terms=terms, loss="squares", fleet=prior
    )


def pooled(
    folder: Path, robots: int, poses: int, seed: int, spread: float, terms: Sequence[str] = ("kinematic",)
) -> Pooled:
    model = RobotModel.from_yaml(write_robot(folder))
    fleet = Fleet.drawn(np.random.default_rng(seed), spread, soft=len(terms) > 1)
    members = over_seeds(member, [(seed, k) for k in range(robots)], model, fleet, poses, terms)
    return Pooled(fleet, model, members, pooled_prior(members))


def member(
    seed: tuple[int, int], model: RobotModel, fleet: Fleet, poses: int, terms: Sequence[str]
) -> Member:
    rng = np.random.default_rng(seed)
    return Member(
        f"robot_{seed[1]}", model, fitted(model, fleet.robot(rng), poses, rng, None, terms).estimate
    )


def errors_elsewhere(
    fit: GeometricFit, robot: SimulatedRobot, rng: np.random.Generator
) -> tuple[float, float]:
    """90th percentile, m, of the errors at poses outside the fit, and the share of the errors in the 95 % intervals of a coordinate."""
    q = random_poses(200, rng)
    at = predict_measurements(
        fit.model, poses_of(q, robot.measured(q, 0.0, rng)), elastic=False, jacobians=True
    )
    names = [n for n in fit.estimate.parameters.names if not n.startswith("scatter.")]
    own = at.jacobian(names)
    covariance = fit.estimate.marginal(names)[1]
    std = np.sqrt(np.einsum("nip,pq,niq->ni", own, covariance, own))
    p90 = float(np.quantile(np.linalg.norm(at.residual, axis=1), 0.9))
    return p90, float(np.mean(np.abs(at.residual) < 1.96 * std))


@pytest.fixture(scope="module")
def six(tmp_path_factory: pytest.TempPathFactory) -> Pooled:
    return pooled(tmp_path_factory.mktemp("six"), robots=6, poses=30, seed=1, spread=0.1)


def test_eight_poses_are_enough_with_the_prior_and_too_few_without(six: Pooled) -> None:
    rng = np.random.default_rng(50)
    robot = six.fleet.robot(rng)
    q = random_poses(8, rng)
    poses = poses_of(q, robot.measured(q, NOISE, rng))
    with refused("E-CAL-009", "8 poses"):
        fit_geometry(six.model, poses, terms=["kinematic"])
    fit = fit_geometry(six.model, poses, terms=["kinematic"], fleet=six.prior)
    p90, inside = errors_elsewhere(fit, robot, rng)
    assert p90 < 3.5e-4
    assert inside > 0.7
    nominal = replace(
        fit,
        model=six.model.with_values(
            {n: v for n, v in fit.estimate.values.items() if n[:4] in ("stat", "tool")}
        ),
    )
    assert errors_elsewhere(nominal, robot, rng)[0] > 10 * p90


def errors_by_count(q: np.ndarray, robot: SimulatedRobot, counts: Sequence[int], known: bool) -> np.ndarray:
    """Root mean square errors at other poses after so many of the first 40 poses, by derivatives of the simulator's own positions by the
    place of the tracker, the target and, unless they are `known`, the links' errors.
    """

    def measured(x: np.ndarray) -> np.ndarray:
        moved = points(q, robot.errors + x[9:].reshape(6, 6), robot.tool + x[:3])
        return moved @ turned(x[3:6]).T + x[6:9]

    steps, here = 1e-7 * np.eye(45)[: 9 if known else 45], measured(np.zeros(45))
    columns = np.stack([(measured(d) - here) / 1e-7 for d in steps], axis=-1)
    found = []
    for count in counts:
        rows = np.concatenate([columns[:count].reshape(-1, len(steps)), 1e-3 * np.eye(len(steps))])
        others = columns[40:].reshape(-1, len(steps)).T
        # what links and their neighbours do alike moves no point
        variance = np.sum(others * np.linalg.lstsq(rows.T @ rows, others, rcond=1e-12)[0])
        found.append(np.sqrt(variance))
    return np.array(found)


@pytest.mark.statistical
def test_how_many_poses_are_enough_is_said_with_a_prior(six: Pooled) -> None:
    """Against derivatives of the simulator, where the other robots tell everything; and nothing."""
    rng = np.random.default_rng(51)
    robot = six.fleet.robot(rng)
    fit = fitted(six.model, robot, 20, rng, six.prior)
    assert fit.fleet is not None
    small, large = (
        replace(fit.fleet, uncertainty=f**2 * fit.fleet.uncertainty, spread=f * fit.fleet.spread)
        for f in (1e-3, 1e3)
    )
    nothing, everything = (EnoughPoses.of(replace(fit, fleet=fleet)) for fleet in (large, small))
    assert nothing is not None and nothing.poses == 40
    plans = [random_poses(56, rng) for _ in range(2)]
    (alone,) = np.mean([errors_by_count(q, robot, [40], False) for q in plans], axis=0)
    counts = range(6, 31)
    known = np.mean([errors_by_count(q, robot, counts, True) for q in plans], axis=0)
    expected = counts[int(np.flatnonzero(known <= alone)[0])]
    assert everything is not None and abs(everything.poses - expected) <= 2
    middle = EnoughPoses.of(fit)
    assert middle is not None and expected < middle.poses < 40
    twice = replace(fit, poses=replace(fit.poses, target=np.repeat(["ball", "other"], 10)))
    assert EnoughPoses.of(twice) is None


def test_the_place_of_the_base_and_the_tool_are_not_pooled(six: Pooled) -> None:
    assert set(base_errors(six.model)) == {
        "joint_1.offset", "joint_1.misalignment_1", "joint_1.misalignment_2", "joint_1.length_z",
    }  # fmt: skip
    assert not {n for n in six.prior.names if n.startswith(("tool.", "station."))}
    assert not set(six.prior.names) & set(base_errors(six.model))


def test_a_robot_of_another_type_is_told_and_one_of_the_type_is_not(six: Pooled) -> None:
    from flexcal.calibration.diagnostics import FleetConflict

    rng = np.random.default_rng(60)
    own, other = six.fleet, Fleet.drawn(rng)
    alike = [FleetConflict.of(fitted(six.model, own.robot(rng), 12, rng, six.prior)) for _ in range(4)]
    assert not any(test is None or test.contradicted for test in alike)
    for count in (10, 25):
        test = FleetConflict.of(fitted(six.model, other.robot(rng), count, rng, six.prior))
        assert test is not None
        assert test.contradicted
        assert test.size > 3
        assert test.shifts


@pytest.mark.statistical
@pytest.mark.parametrize("size", [5e-3, 2e-2, 5e-2])
@pytest.mark.parametrize("count", [14, 40])
def test_a_zero_that_is_far_off_is_told_beside_waves_of_transmission_errors(
    six: Pooled, size: float, count: int
) -> None:
    """Waves whose variance is estimated could take up any zero; with real waves of 0.3 mrad the zero is told, without it nothing is."""
    from flexcal.calibration.diagnostics import FleetConflict

    rng = np.random.default_rng([count, round(1e3 * size)])
    robot, q, phase = six.fleet.robot(rng), random_poses(count, rng), rng.uniform(0, 6, 6)
    waves, zero = 3e-4 * np.sin(q + phase), size * (np.arange(6) == 2)
    tests = []
    for own in (q + waves, q + waves + zero):
        poses = poses_of(q, robot.measured(own, NOISE, rng))
        fit = fit_geometry(
            six.model, poses, terms=("kinematic", "transmission"), loss="squares", fleet=six.prior
        )
        tests.append(FleetConflict.of(fit))
    usual, off = tests
    assert usual is not None and not usual.contradicted
    assert off is not None and off.contradicted and off.alone
    assert "joint_3.offset" in dict(off.shifts)


@pytest.mark.parametrize("joint", [2, 4])
def test_a_zero_that_is_off_is_estimated_without_the_prior(six: Pooled, joint: int) -> None:
    """A motor that was replaced, 20 mrad off beside robots that differ by 0.1 mrad; elsewhere the simulator's positions are met."""
    rng = np.random.default_rng([61, joint])
    robot, q, zero = six.fleet.robot(rng), random_poses(16, rng), 2e-2 * (np.arange(6) == joint)
    measured = poses_of(q, robot.measured(q + zero, NOISE, rng))
    found = calibrate(
        six.model,
        measured,
        terms=["kinematic"],
        loss="squares",
        prior=replace(six.prior, terms=("kinematic",)),
    )
    block = found.document()["fleet"]
    assert f"joint_{joint + 1}.offset" in block["released"] and not block["conflict"]["contradicted"]
    told = " ".join(found.document()["remarks"])
    assert "as after a repair" in told and "does not fit this robot" not in told
    elsewhere = random_poses(200, rng)
    truth = robot.measured(elsewhere + zero, 0.0, rng)
    with_prior = fit_geometry(six.model, measured, terms=["kinematic"], loss="squares", fleet=six.prior)
    p90 = [
        np.quantile(
            np.linalg.norm(
                predict_measurements(fit.model, poses_of(elsewhere, truth), elastic=False).residual, axis=1
            ),
            0.9,
        )
        for fit in (found.selected, with_prior)
    ]
    assert p90[0] < 3e-4 and p90[1] > 5 * p90[0]


def test_the_file_has_the_prior_and_refuses_other_robots(
    six: Pooled, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = []
    rng = np.random.default_rng(70)
    for k in range(3):
        file = write_robot(tmp_path / f"robot_{k}")
        q = random_poses(25, rng)
        measured = write_poses(file.parent / "poses.csv", q, six.fleet.robot(rng).measured(q, NOISE, rng))
        calibrate_robot(file, [measured], terms=["kinematic"])
        files.append(file)
    out = tmp_path / "prior.yaml"
    members = [m for file in files if (m := Member.read(file.parent.name, file).get("calibration"))]
    prior = pool_fleet({"calibration": members}, out)[0].geometry
    again = read_model_prior(out, six.model).geometry
    assert prior is not None
    assert again is not None
    assert again.names == prior.names
    assert again.robots == ("robot_0", "robot_1", "robot_2")
    np.testing.assert_allclose(again.covariance, prior.covariance, rtol=1e-12, atol=1e-20)
    np.testing.assert_array_equal(again.mean, prior.mean)

    new = write_robot(tmp_path / "new")
    q = random_poses(12, rng)
    robot = six.fleet.robot(rng)
    few = write_poses(tmp_path / "few.csv", q, robot.measured(q, NOISE, rng))
    result = calibrate_robot(new, [few], prior=out, out=tmp_path / "out")
    block: Any = result.document()["fleet"]
    assert block["robots"] == list(prior.robots)
    assert not block["conflict"]["contradicted"]
    assert any("prior of 3 other robots" in remark for remark in result.document()["remarks"])
    assert 20 < block["enough"]["poses"] <= 40
    assert any("40 without it" in remark for remark in result.document()["remarks"])
    assert (tmp_path / "out" / "report.html").exists()

    with refused("E-PRIOR-010", "25", "25", "robot_0"):
        calibrate_robot(files[0], [files[0].parent / "poses.csv"], prior=out)
    with refused("E-PRIOR-011", "kinematic", "offsets"):
        calibrate_robot(new, [few], terms=["offsets"], prior=out)

    plan = tmp_path / "plan.csv"
    arguments = ["design", "poses", str(new), "--candidates", "200", "--out", str(plan), "--prior"]
    assert main([*arguments, str(out), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["prior"]["robots"] == list(prior.robots) and document["enough_poses"] is None
    assert 6 < document["prior"]["enough"]["poses"] == document["poses"] <= 40
    assert document["tool_error_mm"] < document["tool_error_p90_mm"] < 2 * document["tool_error_mm"]
    assert "prior of 3 other robots" in plan.with_suffix(".html").read_text()
    assert main([*arguments, str(out), "--count", "6"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert (
        "prior from 3 other robots" in said and "6 poses" in said and "chosen poses with this prior" in said
    )
    nothing, wrong = tmp_path / "nothing.yaml", tmp_path / "wrong.yaml"
    text = out.read_text()
    wrong.write_text(text.replace("  joint_2.offset:", "  joint_9.offset:"))
    nothing.write_text(
        re.sub(
            r"(?ms)^parameters:.*?(?=^\w)",
            "parameters: {}\n",
            re.sub(r"(?ms)^correlation:.*?(?=^\w)", "correlation: []\n", text),
        )
    )
    for given, options, code in (
        (wrong, [], "E-PRIOR-019"),
        (nothing, [], "E-PRIOR-018"),
        (out, ["--criterion", "E"], "E-DESIGN-058"),
        (out, ["--random"], "E-CLI-048"),
    ):
        assert main([*arguments, str(given), *options]) == 2
        assert code in capsys.readouterr().err

    stranger = Fleet.drawn(rng).robot(rng)
    unlike = write_poses(tmp_path / "unlike.csv", q, stranger.measured(q, NOISE, rng))
    told = calibrate_robot(new, [unlike], prior=out, out=tmp_path / "unlike")
    assert told.trust.document() == {"trusted": False, "reasons": ["fleet"]}
    assert told.document()["fleet"]["enough"] is None
    assert "the prior of other robots does not fit this one" in told.trust.sentence
    said = " ".join(told.document()["remarks"])
    assert "the prior does not fit this robot" in said
    assert "because the prior of other robots holds it where this robot is not" in said
    assert "scatter of instrument and robot together" not in said
    assert "in addition to the stated sigma" not in said

    odd = write_robot(tmp_path / "odd")
    urdf = odd.parent / "arm.urdf"
    urdf.write_text(urdf.read_text().replace('xyz="0.42', 'xyz="0.43'))
    with refused("E-PRIOR-007", "joint_3", "10 mm"):
        read_model_prior(out, RobotModel.from_yaml(odd))
    assert main(["design", "poses", str(odd), "--prior", str(out), "--out", str(plan)]) == 2
    assert "E-PRIOR-007" in capsys.readouterr().err
    # a robot with this prior would count the others twice
    calibrate_robot(new, [few], prior=out)
    with refused("E-PRIOR-005", "new"):
        pool_fleet({"calibration": [*members, Member.read("new", new)["calibration"]]}, out)
    assert not Member.read("odd", odd)
    with refused("E-PRIOR-002", "at least 3", "2"):
        pool_fleet({"calibration": members[:2]}, out)
    with refused("E-PRIOR-003", "odd", "robot_0", "joint_3"):
        pooled_prior([*members, replace(members[1], name="odd", model=RobotModel.from_yaml(odd))])


def test_too_few_robots_are_said_with_what_was_left_out(six: Pooled, tmp_path: Path) -> None:
    """Robots that were all calibrated with a prior count in none: not a bare number of 0."""
    for k, member in enumerate(six.members[:3]):
        file = write_robot(tmp_path / "fleet" / f"cell_{k}")
        origin = {**member.estimate.provenance, "input.fleet": "0" * 64}
        write_estimates(
            file.parent / "estimates.yaml", "calibration", replace(member.estimate, provenance=origin)
        )
    with refused("E-PRIOR-002", "without cell_0, cell_1, cell_2, calibrated with a prior of other robots"):
        write_prior(tmp_path / "fleet", tmp_path / "prior.yaml")


def test_a_robot_that_differs_from_the_others_is_not_pooled(six: Pooled, tmp_path: Path) -> None:
    """Another batch, by an error far beyond what robots of the fleet differ by."""
    fleet = tmp_path / "fleet"
    files = [write_robot(fleet / f"cell_{k}").parent / "estimates.yaml" for k in range(len(six.members))]
    for file, member in zip(files, six.members, strict=True):
        write_estimates(file, "calibration", member.estimate)
    pooled = write_prior(fleet, tmp_path / "all.yaml").prior.geometry
    assert pooled is not None and len(pooled.robots) == 6
    name = next(spread.name for spread in review_fleet(fleet).spreads if spread.name in pooled.names)
    estimate = six.members[4].estimate
    moved = [replace(p, value=p.value + 0.03) if p.name == name else p for p in estimate.parameters]
    write_estimates(files[4], "calibration", replace(estimate, parameters=Parameters(moved)))
    written = write_prior(tmp_path / "fleet", tmp_path / "prior.yaml")
    assert written.prior.geometry is not None and "cell_4" not in written.prior.geometry.robots
    assert len(written.prior.geometry.robots) == 5
    (said,) = [remark for remark in written.remarks if "cell_4" in remark]
    assert f"without cell_4, whose geometry differs from that of the others beyond chance in {name}" in said


def test_calibrations_that_tell_nothing_of_the_arm_are_refused(six: Pooled) -> None:
    members = []
    for member in six.members[:3]:
        stations = [n for n in member.estimate.parameters.names if n.startswith("station.")]
        parameters, covariance = (
            member.estimate.parameters.subset(stations),
            member.estimate.marginal(stations)[1],
        )
        own = replace(
            member.estimate,
            parameters=parameters,
            covariance=covariance,
            dropped=(),
            identifiable=(True,) * len(stations),
        )
        members.append(replace(member, estimate=own))
    with refused("E-PRIOR-012", "robot_0", "robot_1", "robot_2"):
        pooled_prior(members)


def test_one_robot_that_was_measured_twice_is_named(six: Pooled) -> None:
    rng = np.random.default_rng(80)
    robot = six.fleet.robot(rng)
    twice = [
        Member(name, six.model, fitted(six.model, robot, 30, rng, None).estimate)
        for name in ("once", "again")
    ]
    assert not alike(six.members)
    assert [pair[:2] for pair in alike([*six.members, *twice])] == [("once", "again")]


def test_the_fleet_writes_the_prior_of_its_model(
    six: Pooled, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for k, member in enumerate(six.members[:4]):
        file = write_robot(tmp_path / "fleet" / f"cell_{k}")
        estimate = member.estimate
        if k == 3:
            estimate = replace(estimate, provenance={**estimate.provenance, f"input.{FLEET}": "0"})
        write_estimates(file.parent / "estimates.yaml", "calibration", estimate)
    shutil.copytree(tmp_path / "fleet" / "cell_0", tmp_path / "fleet" / "cell_0_backup")
    out = tmp_path / "prior.yaml"
    assert (
        main(["fleet", str(tmp_path / "fleet"), "--out", str(tmp_path / "t.parquet"), "--prior", str(out)])
        == 0
    )
    said = " ".join(capsys.readouterr().out.split())
    assert "from 3 robots (cell_0, cell_1, cell_2)" in said
    assert "without cell_0_backup, whose calibration is the same as that of cell_0" in said
    assert "without cell_3, calibrated with a prior of other robots" in said
    assert "the results of 4 robots in the folders of 5: those of cell_0_backup (cell_0) are copies" in said
    assert "no results in" not in said
    told = read_model_prior(out, six.model).geometry
    assert told is not None
    assert told.robots == ("cell_0", "cell_1", "cell_2")


def test_the_largest_group_of_one_geometry_is_pooled(
    six: Pooled, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A robot of another geometry under the same URDF name is left out by its name; the table is there whatever becomes of the prior."""
    fleet = tmp_path / "fleet"
    for k, member in enumerate(six.members[:4]):
        file = write_robot(fleet / f"cell_{k}")
        write_estimates(file.parent / "estimates.yaml", "calibration", member.estimate)
        if k == 0:
            urdf = file.parent / "arm.urdf"
            urdf.write_text(urdf.read_text().replace('xyz="0.42', 'xyz="0.43'))
    table, out = tmp_path / "t.parquet", tmp_path / "prior.yaml"
    assert main(["fleet", str(fleet), "--out", str(table), "--prior", str(out)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "from 3 robots (cell_1, cell_2, cell_3)" in said
    assert "without cell_0, of another model than the 3 robots that were pooled: joint_3 is 10 mm" in said
    told = read_model_prior(out, six.model).geometry
    assert told is not None and told.robots == ("cell_1", "cell_2", "cell_3")
    with refused("E-PRIOR-007", str(fleet / "cell_0" / "robot.yaml"), str(out)):
        read_model_prior(out, RobotModel.from_yaml(fleet / "cell_0" / "robot.yaml", estimates=False))

    shutil.rmtree(fleet / "cell_3")
    table.unlink()
    out.unlink()
    assert main(["fleet", str(fleet), "--out", str(tmp_path / "u.parquet"), "--prior", str(out)]) == 2
    told = capsys.readouterr().err
    assert "E-PRIOR-001" in told and "cell_1, cell_2; cell_0" in told
    assert (tmp_path / "u.parquet").exists() and (tmp_path / "u.html").exists() and not out.exists()
    assert main(["fleet", str(fleet), "--out", str(tmp_path / "u.parquet")]) == 0


def test_a_robot_in_two_folders_is_said_and_counts_once(six: Pooled, tmp_path: Path) -> None:
    rng = np.random.default_rng(80)
    robot = six.fleet.robot(rng)
    twice = [fitted(six.model, robot, 30, rng, None).estimate for _ in range(2)]
    for k, estimate in enumerate([*(m.estimate for m in six.members), *twice]):
        file = write_robot(tmp_path / f"cell_{k}")
        data = {"input.poses.csv": f"{k:064d}", "option.terms": "kinematic"}
        own = replace(estimate, provenance={**estimate.provenance, **data})
        write_estimates(file.parent / "estimates.yaml", "calibration", own)
    fleet = review_fleet(tmp_path)
    remarks = fleet.document()["remarks"]
    assert any(
        r.startswith("probably one robot") and "cell_6 and cell_7 differ by no more" in r for r in remarks
    )
    assert fleet.spreads and all("cell_7" not in spread.robots for spread in fleet.spreads)
    assert max(len(spread.robots) for spread in fleet.spreads) == 7


def test_robots_of_two_batches_are_told_apart(six: Pooled, tmp_path: Path) -> None:
    """Four robots of another type under the same URDF; with one of them alone there is nothing to say of groups."""
    rng = np.random.default_rng(90)
    other = Fleet.drawn(rng)
    odd = [fitted(six.model, other.robot(rng), 30, rng, None).estimate for _ in range(4)]
    fleets = {"outlying": 1, "two": 4}
    for name, others in fleets.items():
        for k, estimate in enumerate([*(m.estimate for m in six.members), *odd[:others]]):
            file = write_robot(tmp_path / name / f"cell_{k}")
            data = {"input.poses.csv": f"{k:064d}", "option.terms": "kinematic"}
            own = replace(estimate, provenance={**estimate.provenance, **data})
            write_estimates(file.parent / "estimates.yaml", "calibration", own)
    assert review_fleet(tmp_path / "outlying").document()["batches"] == []
    fleet = review_fleet(tmp_path / "two")
    (entry,) = fleet.document()["batches"]
    assert entry["robots"] == [[f"cell_{k}" for k in range(6)], [f"cell_{k}" for k in range(6, 10)]]
    assert entry["adjusted_probability"] < 0.05 and entry["separation"] > 10
    assert set(entry["differing"]) <= set(six.prior.names) and len(entry["differing"]) == 3
    assert entry["sentence"] in fleet.document()["remarks"]
    assert "cell_6, cell_7, cell_8, cell_9 (4)" in entry["sentence"]
    written = write_prior(tmp_path / "two", tmp_path / "prior.yaml", fleet)
    assert any("the prior is of two groups of robots" in remark for remark in written.remarks)
    fleet.write(tmp_path / "t.parquet")
    assert "is of two groups of robots" in (tmp_path / "t.html").read_text().lower()


def test_other_temperatures_are_said(six: Pooled, tmp_path: Path) -> None:
    at = [(19.0, 21.0), (30.0, 32.0), None, (20.0, 20.0)]
    members = [
        replace(m, estimate=replace(m.estimate, ranges={} if t is None else {"temperature": t}))
        for m, t in zip(six.members, at, strict=False)
    ]
    _, remarks = pool_fleet({"calibration": members}, tmp_path / "prior.yaml")
    said = " ".join(remarks)
    assert "calibrated at 20 (robot_0) to 31 °C (robot_1)" in said
    # 11 K of steel and of aluminium
    assert "up to 0.13 to 0.25 mm/m" in said
    assert "the temperature of robot_2 is not known" in said
    assert not pool_fleet({"calibration": six.members}, tmp_path / "prior.yaml")[1]


def test_robots_with_other_terms_are_left_out(six: Pooled, tmp_path: Path) -> None:
    def with_terms(member: Member, terms: str) -> Member:
        return replace(member, estimate=replace(member.estimate, provenance={"option.terms": terms}))

    alike = [with_terms(member, "kinematic transmission") for member in six.members]
    members = [with_terms(six.members[0], "kinematic lateral_compliance"), *alike[1:]]
    prior, remarks = pool_fleet({"calibration": members}, tmp_path / "prior.yaml")
    assert prior.geometry is not None
    assert prior.geometry.robots == tuple(member.name for member in alike[1:])
    assert prior.geometry.terms == ("kinematic",)
    (said,) = (remark for remark in remarks if "terms" in remark)
    assert said.startswith("without robot_0, calibrated with the terms kinematic lateral_compliance")
    assert "--terms kinematic'" in said
    few = [members[0], with_terms(six.members[1], "kinematic gravity_compliance"), *alike[2:4]]
    with refused("E-PRIOR-004", "robot_0 with kinematic lateral_compliance", "--terms kinematic."):
        pool_fleet({"calibration": few}, tmp_path / "prior.yaml")


def chosen_poses(batch: Pooled, count: int) -> np.ndarray:
    """Joint positions (N, 6) that are chosen for the prior of a fleet, from those that random poses are of."""
    rng = np.random.default_rng(77)
    q = random_poses(2000, rng)
    candidates = pose_candidates(
        batch.model,
        rng=rng,
        candidates=PosePool(q, np.arange(1, len(q) + 1)),
        setup=MeasuringSetup(noise=TrackerNoise(NOISE, 0.0)),
        working=random_poses(300, rng),
        fleet=batch.prior,
    )
    return choose_poses(candidates, count, rng=rng).plan.q


def next_robot(
    number: int, batch: Pooled, terms: Sequence[str], plan: np.ndarray
) -> tuple[float, float, float, float, float]:
    """90th percentile, m, of a robot's errors after 40 poses without the others; after 15 with them, and share in their intervals; and so
    with the poses of a plan.
    """
    rng = np.random.default_rng([124, number])
    robot = batch.fleet.robot(rng)
    alone = errors_elsewhere(fitted(batch.model, robot, 40, rng, None, terms), robot, rng)[0]
    few = errors_elsewhere(fitted(batch.model, robot, 15, rng, batch.prior, terms), robot, rng)
    poses = poses_of(plan, robot.measured(plan, NOISE, rng))
    fit = fit_geometry(batch.model, poses, terms=terms, loss="squares", fleet=batch.prior)
    return alone, *few, *errors_elsewhere(fit, robot, rng)


@pytest.mark.slow
def test_a_fleet_of_thirty_tells_the_next_robot(tmp_path: Path) -> None:
    """Of soft robots that differ by 5 % of what their type is off, 15 poses are about as good as 40 without the others; 15 chosen ones
    are as good.
    """
    soft = ["kinematic", "gravity_compliance", "lateral_compliance"]
    batch = pooled(tmp_path, robots=30, poses=40, seed=24, spread=0.05, terms=soft)
    plan = chosen_poses(batch, 15)
    alone, few, inside, chosen, within = np.transpose(over_seeds(next_robot, range(8), batch, soft, plan))
    print(
        f"{1e3 * np.mean(few):.4f} mm, {1e3 * np.mean(chosen):.4f} mm chosen, {1e3 * np.mean(alone):.4f} mm alone, "
        f"{100 * np.mean(inside):.1f} %, {100 * np.mean(within):.1f} % inside"
    )
    assert np.mean(few) < 1.25 * np.mean(alone)
    assert np.mean(chosen) < 1.1 * np.mean(alone)
    assert 0.92 < np.mean(inside) < 0.99 and 0.92 < np.mean(within) < 0.99
