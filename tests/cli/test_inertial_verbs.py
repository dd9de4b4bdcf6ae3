"""`design trajectory`, `measure` and `identify inertials`: stage 0 of the demonstration, verb by verb."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from cli_files import copied
from refusals import assert_refusal
from test_bad_input import refused_run

from flexcal.cli.main import main
from flexcal.data.plans import FourierPaths, TrajectoryPlan, read_plan_of, write_plan
from flexcal.files.formats import read_estimates, read_yaml, sha256_of
from flexcal.jobs.experiments import exciting_plan
from flexcal.jobs.two_stage import inertial_stage as stage_zero
from flexcal.model.robot import RobotModel
from flexcal.progress import silent
from flexcal.report.layout import significant
from flexcal.virtual_cell import CellConfig, VirtualCell, draw_truth, read_truth

LOG = "pose_1_realisation_1_experiment_1_plus.parquet"


@pytest.fixture(scope="module")
def recorded(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The TX90L's folder with one trajectory and what the virtual cell recorded by it."""
    folder = copied(examples / "tx90l", tmp_path_factory.mktemp("cli") / "tx90l")
    plan = folder / "trajectory.yaml"
    asked = ("--count", 1, "--criterion", "posterior", "--searches", 1, "--seed", 5)
    design = ("design", "trajectory", folder / "robot.yaml", *asked, "--out", plan)
    measure = ("measure", plan, "--cell", "virtual", "--seed", 5, "--out", folder / "exciting")
    for arguments in (design, measure):
        assert main([str(a) for a in arguments]) == 0
    return folder


@pytest.fixture(scope="module")
def identified(recorded: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the verb leaves with --out."""
    out = tmp_path_factory.mktemp("cli") / "inertials"
    arguments = ("identify", "inertials", recorded / "robot.yaml", recorded / "exciting", "--out", out)
    assert main([str(a) for a in arguments]) == 0
    assert not (recorded / "estimates.yaml").exists()
    return out


def test_the_report_says_what_the_results_say(identified: Path) -> None:
    page = (identified / "report.html").read_text("utf-8")
    results = json.loads((identified / "results.json").read_text("utf-8"))
    estimate = read_estimates(identified / "estimates.yaml")["dynamics"]
    for key in ("nominal", "train"):
        assert f"{significant(results['error_percent'][key], 3)}" in page
    for name in ("link_2.mass", "joint_3.viscous"):
        low, high = estimate.interval(name) or (0.0, 0.0)
        assert f"{significant(low, 3)} to {significant(high, 3)}" in page
    assert results["command"] in page and estimate.provenance["input.tx90l.urdf"] in page
    assert main(["report", str(identified)]) == 0
    assert (identified / "report.html").read_text("utf-8") == page


def test_what_is_said_leads_on(
    recorded: Path, identified: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command line after a plan that is not beside its robot finds the robot; so do later verbs estimates that are elsewhere."""
    robot, plan = recorded / "robot.yaml", tmp_path / "plan.yaml"
    quick = ("--count", "1", "--searches", "1")
    assert main(["design", "trajectory", str(robot), *quick, "--out", str(plan)]) == 0
    following = capsys.readouterr().out.splitlines()[-1]
    words = following.partition("next: flexcal ")[2].partition("; or ")[0].split()
    words[words.index("exciting")] = str(tmp_path / "exciting")
    assert main(words) == 0
    out = tmp_path / "inertials"
    assert main(["identify", "inertials", str(robot), str(tmp_path / "exciting"), "--out", str(out)]) == 0
    line = capsys.readouterr().out.partition("add the line '")[2].partition("'")[0]
    (recorded / "elsewhere.yaml").write_text(f"{robot.read_text()}\n{line}\n")
    found = read_estimates(out / "estimates.yaml")["dynamics"]
    model = RobotModel.from_yaml(recorded / "elsewhere.yaml")
    (recorded / "elsewhere.yaml").unlink()
    assert model.value("link_2.mass") == found.quantity("link_2.mass")["estimate"]


def test_the_verbs_are_stage_zero_of_the_demo(
    recorded: Path, identified: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same plan, byte by byte, and the same estimate from recordings that went through files."""
    monkeypatch.setattr(stage_zero, "exciting_plan", partial(exciting_plan, count=1))
    nominal = RobotModel.from_yaml(recorded / "robot.yaml", estimates=False)
    config = read_yaml(recorded / "cell.yaml", CellConfig)
    truth = draw_truth(nominal, config.spread, np.random.default_rng([5, 0]))
    cell = VirtualCell(nominal.with_values(truth), config, 5, controller_model=nominal)
    demo = stage_zero.run_stage_zero(cell, nominal, tmp_path, seed=5, progress=silent)
    assert (tmp_path / "trajectory_plan.yaml").read_bytes() == (recorded / "trajectory.yaml").read_bytes()
    verb = read_estimates(identified / "estimates.yaml")["dynamics"]
    assert verb.parameters.names == demo.parameters.names
    std = np.sqrt(np.diag(demo.covariance))
    np.testing.assert_allclose(
        (verb.parameters.coordinates() - demo.parameters.coordinates()) / std, 0.0, atol=1e-9
    )
    np.testing.assert_allclose(np.sqrt(np.diag(verb.covariance)), std, rtol=1e-9)


def test_intervals_hold_the_truth(recorded: Path, identified: Path) -> None:
    truth = read_truth(recorded / "exciting" / "truth.yaml")
    document = json.loads((identified / "results.json").read_text())
    known = {name: q for name, q in document["parameters"].items() if name in truth}
    inside = [q["low"] < truth[name] < q["high"] for name, q in known.items()]
    assert len(inside) == 30 and np.mean(inside) > 0.85
    assert known["link_2.com_x"]["std"] < 1e-3
    assert document["trajectories"] == 1
    assert 0 < document["error_percent"]["train"] < 0.5 < 2 < document["error_percent"]["nominal"]


def test_the_robot_has_it_and_running_again_changes_nothing(
    run, recorded: Path, identified: Path, tmp_path: Path
) -> None:
    """`identify stiffness` starts from this block as from the demo's."""
    robot = copied(recorded, tmp_path / "tx90l") / "robot.yaml"
    page = run("identify", "inertials", robot, recorded / "exciting")
    assert page.status == 0
    assert "link_6.com_z" in page.out and "flexcal design frequency" in page.out
    estimates = robot.parent / "estimates.yaml"
    assert estimates.read_bytes() == (identified / "estimates.yaml").read_bytes()
    found = read_estimates(estimates)["dynamics"]
    name = "joint_2.rotor_inertia"
    assert RobotModel.from_yaml(robot).value(name) == pytest.approx(found.values[name])
    inputs = {key.removeprefix("input.") for key in found.provenance if key.startswith("input.")}
    assert inputs == {"robot.yaml", "tx90l.urdf", "plan.yaml", LOG}


def test_every_verb_says_what_follows(run, recorded: Path, tmp_path: Path) -> None:
    plan = tmp_path / "trajectory.yaml"
    quick = ("--count", 1, "--searches", 1, "--criterion", "posterior")
    design = run("design", "trajectory", recorded / "robot.yaml", *quick, "--out", plan, "--json")
    assert design.document["seconds_on_the_robot"] == pytest.approx(15.0)
    assert design.document["payload"] == 0.0
    assert f"flexcal measure {plan}" in design.err
    taken = (
        "measure",
        recorded / "trajectory.yaml",
        "--cell",
        recorded / "exciting",
        "--out",
        tmp_path / "a",
    )
    assert f"flexcal identify inertials {recorded / 'robot.yaml'} {tmp_path / 'a'}" in run(*taken).out


def scaled(factor: float) -> Callable[[pl.DataFrame], pl.DataFrame]:
    return lambda log: log.with_columns(pl.col("^tau.$") * factor)


def saturated(log: pl.DataFrame) -> pl.DataFrame:
    return log.with_columns(tau2=pl.col("tau2").clip(-0.6 * log["tau2"].abs().max(), None))


BAD = {
    "other sign": (scaled(-1.0), ["E-RUN-036"]),
    "no torque": (scaled(0.0), ["E-DYN-034", "pose_1_realisation_1_experiment_1_plus.parquet", "joint_1"]),
    "one torque missing": (lambda f: f.drop("tau2"), ["E-TABLE-006", "tau2"]),
    "saturated": (saturated, ["E-DYN-035", "pose_1_realisation_1_experiment_1_plus.parquet", "joint_2"]),
    "standstill": (
        lambda f: f.with_columns(pl.col("^q.$").first()),
        ["E-DYN-040", "pose_1_realisation_1_experiment_1_plus.parquet", "1"],
    ),
    "too short": (
        lambda f: f[:-20],
        ["E-DYN-039", "pose_1_realisation_1_experiment_1_plus.parquet", "59980", "60000"],
    ),
}


@pytest.mark.parametrize(("change", "refusal"), BAD.values(), ids=BAD.keys())
def test_bad_logs(
    run, recorded: Path, tmp_path: Path, change: Callable[[pl.DataFrame], pl.DataFrame], refusal: list[str]
) -> None:
    folder = copied(recorded / "exciting", tmp_path / "exciting")
    change(pl.read_parquet(folder / LOG)).write_parquet(folder / LOG)
    out = ("--out", tmp_path / "out")
    sentence = refused_run(run, tmp_path, "identify", "inertials", recorded / "robot.yaml", folder, *out)
    assert_refusal(sentence, *refusal)


def test_folders_of_other_plans(run, recorded: Path, tmp_path: Path) -> None:
    robot, folder = recorded / "robot.yaml", copied(recorded / "exciting", tmp_path / "exciting")
    inertials = ("identify", "inertials", robot, folder)
    sentence = refused_run(run, tmp_path, "identify", "response", robot, folder, "--out", tmp_path / "out")
    assert_refusal(sentence, "E-RUN-073", "trajectories", "identify inertials")
    (folder / LOG).unlink()
    assert_refusal(refused_run(run, tmp_path, *inertials), "E-EXP-001", LOG.replace(".parquet", ".csv"))
    for verb, following in (("poses", "calibrate"), ("frequency", "identify response")):
        plan = tmp_path / f"{verb}.yaml"
        options = ("--random", "--count", 3) if verb == "poses" else ()
        assert run("design", verb, robot, *options, "--out", plan).status == 0
        shutil.copy(plan, folder / "plan.yaml")
        assert_refusal(refused_run(run, tmp_path, *inertials), "E-RUN-035", f"'flexcal {following}'")


REFUSED = {
    ("--duration", 3): ["E-DESIGN-049", "3", "0.2"],
    ("--duration", 12): ["E-DESIGN-050", "2.4"],
    ("--of", "link_3.mass"): ["E-DESIGN-041", "c"],
    ("--criterion", "c", "--of", "link_3.mas"): ["E-ROBOT-043", "link_3.mas", "link_3.mass"],
    ("--criterion", "c", "--of", "link_1.com_z"): ["E-DESIGN-042", "link_1.com_z", "not at all"],
    ("--criterion", "c", "--of", "link_1.Izz", "joint_1.rotor_inertia"): [
        "E-DESIGN-042",
        "only together with joint_1.rotor_inertia",
    ],
    ("--start", 0, 0): ["E-RUN-043", "2", "tx90l", "6"],
    ("--start", 0, 0, 9, 0, 0, 0): ["E-DESIGN-044", "joint_3 is at 9"],
    ("--start", 0, 2.2, 2.2, 0, 0, 0): ["E-DESIGN-044", "touches"],
}


def test_what_cannot_be_designed(run, recorded: Path, tmp_path: Path) -> None:
    robot = copied(recorded, tmp_path / "tx90l") / "robot.yaml"
    arguments = ("design", "trajectory", robot, "--out", tmp_path / "plan.yaml")
    assert_refusal(refused_run(run, tmp_path, *arguments, "--count", 0), "E-CLI-008", "--count", "0")
    for words, refusal in REFUSED.items():
        assert_refusal(refused_run(run, tmp_path, *arguments, *words), *refusal)


def test_a_robot_without_controller_gets_a_plan_that_the_virtual_cell_refuses(
    run, recorded: Path, tmp_path: Path
) -> None:
    robot = copied(recorded, tmp_path / "tx90l") / "robot.yaml"
    text = robot.read_text().splitlines(keepends=True)
    robot.write_text("".join(line for line in text if not line.startswith("controller:")))
    plan = robot.parent / "plan.yaml"
    quick = ("--count", 1, "--searches", 1, "--criterion", "posterior")
    assert run("design", "trajectory", robot, *quick, "--out", plan).status == 0
    assert read_plan_of(plan, TrajectoryPlan).rate_hz == 1000.0
    measure = ("measure", plan, "--cell", "virtual", "--out", tmp_path / "measured")
    assert_refusal(refused_run(run, tmp_path, *measure), "E-CELL-029")


def test_a_plan_of_more_trajectories_needs_all_logs(run, recorded: Path, tmp_path: Path) -> None:
    folder = copied(recorded / "exciting", tmp_path / "exciting")
    plan = read_plan_of(folder / "plan.yaml", TrajectoryPlan)
    twice = FourierPaths.of_coefficients(np.repeat(plan.paths.coefficients, 2, axis=0))
    write_plan(folder / "plan.yaml", replace(plan, paths=twice))
    arguments = ("identify", "inertials", recorded / "robot.yaml", folder)
    assert_refusal(
        refused_run(run, tmp_path, *arguments), "E-EXP-001", "pose_1_realisation_2_experiment_1_plus.csv"
    )


def test_measurements_of_another_plan_are_kept(run, recorded: Path, tmp_path: Path) -> None:
    """Without the refusal, the files of one plan would take the names of the other's."""
    robot, folder = recorded / "robot.yaml", copied(recorded / "exciting", tmp_path / "exciting")
    before = sha256_of(folder)
    plan = tmp_path / "points.yaml"
    assert run("design", "poses", robot, "--random", "--count", 3, "--out", plan).status == 0
    done = run("measure", plan, "--robot", robot, "--cell", "virtual", "--out", folder)
    assert done.status == 2
    assert_refusal(done.err, "E-RUN-040")
    assert sha256_of(folder) == before
