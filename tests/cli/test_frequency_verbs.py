"""`measure`, `identify response` and `identify stiffness`, on an experiment of a few seconds in the virtual cell."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from cli_files import copied
from refusals import assert_refusal
from small_plan import small_plan
from test_bad_input import refused_run
from waiting import PATIENCE

from flexcal.cli.arguments.verb_table import find_verb
from flexcal.cli.main import main
from flexcal.data.plans import MultisinePlan, read_plan_of, write_plan
from flexcal.elasticity.identification import PopulationSearch
from flexcal.estimation import Parameters
from flexcal.files.formats import read_estimates, sha256_of
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell import read_truth

LOG = "pose_2_realisation_1_experiment_3_minus.parquet"


@pytest.fixture(scope="module")
def recorded(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The TX90L's folder with a small plan and what the virtual cell recorded by it."""
    folder = copied(examples / "tx90l", tmp_path_factory.mktemp("cli") / "tx90l")
    assert main(["design", "frequency", str(folder / "robot.yaml"), "--out", str(folder / "whole.yaml")]) == 0
    whole = read_plan_of(folder / "whole.yaml", MultisinePlan)
    small = small_plan(whole)
    write_plan(folder / "small.yaml", small)
    arguments = [
        "measure",
        folder / "small.yaml",
        "--cell",
        "virtual",
        "--seed",
        "4",
        "--out",
        folder / "recorded",
    ]
    assert main([str(a) for a in arguments]) == 0
    return folder


@pytest.fixture(scope="module")
def responses(recorded: Path) -> Path:
    """The responses identified from what was recorded."""
    out = recorded.parent / "responses"
    arguments = ["identify", "response", recorded / "robot.yaml", recorded / "recorded", "--out", out]
    assert main([str(a) for a in arguments]) == 0
    return out


@pytest.fixture(scope="module")
def stiff_robot(recorded: Path, responses: Path) -> Path:
    """The robot's folder with the stiffnesses that these responses tell, which were asked for as JSON (`stiffness.json`)."""
    folder = copied(recorded, recorded.parent / "stiff" / "tx90l")
    arguments = ["identify", "stiffness", str(folder / "robot.yaml"), str(responses), "--json"]
    with (folder / "stiffness.json").open("w", encoding="utf-8") as stream, redirect_stdout(stream):
        assert main(arguments) == 0
    return folder


def test_plan_says_how_long_it_takes(run, tx90l_folder: Path) -> None:
    out = tx90l_folder / "paper.yaml"
    found = run(
        "design", "frequency", tx90l_folder / "robot.yaml", "--plan", "paper", "--out", out, "--json"
    ).document
    plan = read_plan_of(out, MultisinePlan)
    assert found["poses"] == len(plan.poses) == 3
    assert found["excited_axes"] == [1, 2, 3]
    assert found["seconds_on_the_robot"] == pytest.approx(3 * 384)
    assert plan.payload == 0.0


def test_small_peaks_and_lines_left_out(run, tx90l_folder: Path) -> None:
    """Both options from plan to response: the robot's torque peaks less for the same power, and odd distortion is reported."""
    robot, peaks = tx90l_folder / "robot.yaml", {}
    for crest in ("random", "optimised"):
        file, out = tx90l_folder / f"{crest}.yaml", tx90l_folder / crest
        options = ("--crest", crest, "--detection-lines", "--out", file)
        assert run("design", "frequency", robot, *options, "--json").document["detection_lines"] == 154 // 4
        whole = read_plan_of(file, MultisinePlan)
        assert whole.crest == crest and not set(whole.lines) & set(whole.detection_lines)
        short = replace(
            whole, poses=whole.poses[:1], realisations=3, periods=2, settle_periods=1, rate_hz=1000.0
        )
        write_plan(file, replace(short, reference_amplitude=0.0))
        assert run("measure", file, "--cell", "virtual", "--out", out).status == 0
        logs = [pl.read_parquet(log) for log in sorted(out.glob("pose_1_*_plus.parquet"))]
        torque = np.stack([log.select("tau1", "tau2", "tau3").to_numpy()[-4000:] for log in logs])
        torque = torque - torque.mean(1, keepdims=True)
        peaks[crest] = np.max(np.abs(torque).max(1) / torque.std(1))
        arguments = ("identify", "response", robot, out, "--out", tx90l_folder / "responses", "--json")
        (entry,) = run(*arguments).document["responses"]
        assert len(entry["odd_distortion"]) == 3 and 0 < max(entry["odd_distortion"]) < 1
    assert peaks["optimised"] < 0.85 * peaks["random"]


def test_measure_leaves_plan_logs_truth_and_results(recorded: Path) -> None:
    names = {p.name for p in (recorded / "recorded").iterdir()}
    assert {".flexcal", "plan.yaml", "truth.yaml", "results.json", LOG} <= names
    assert len(names) == 4 + 2 * 3 * 3 * 2
    verb = find_verb(["measure"])
    assert verb is not None
    known = {name for name in names if any(fnmatch(name, pattern) for pattern in verb.leaves)}
    assert names - known == {".flexcal"}


def test_recorded_files_may_be_taken_over(run, recorded: Path, tmp_path: Path) -> None:
    out = tmp_path / "again"
    arguments = ("measure", recorded / "small.yaml", "--cell", recorded / "recorded", "--out", out, "--json")
    assert run(*arguments).document["recordings"] == 36
    assert pl.read_parquet(out / LOG).equals(pl.read_parquet(recorded / "recorded" / LOG))
    assert not (out / "truth.yaml").exists()


def test_same_seed_same_bytes(run, recorded: Path, tmp_path: Path) -> None:
    arguments = (
        "measure",
        recorded / "small.yaml",
        "--cell",
        "virtual",
        "--seed",
        4,
        "--out",
        tmp_path / "again",
    )
    assert run(*arguments).status == 0
    for name in (LOG, "truth.yaml"):
        assert (tmp_path / "again" / name).read_bytes() == (recorded / "recorded" / name).read_bytes()


def test_responses(run, recorded: Path, tmp_path: Path) -> None:
    arguments = ("identify", "response", recorded / "robot.yaml", recorded / "recorded", "--out", tmp_path)
    assert "flexcal identify stiffness" in run(*arguments).out
    first, second = (FrequencyResponse.load(tmp_path / f"response_pose_{k}.npz") for k in (1, 2))
    assert (first.pose, second.pose) == (0, 1)
    assert first.joints == ("joint_1", "joint_2", "joint_3")
    assert np.median(np.abs(first.std / first.response)[:, [0, 1, 2], [0, 1, 2]]) < 0.2
    document = run(*arguments, "--json").document
    assert [entry["pose"] for entry in document["responses"]] == [1, 2]
    assert len(document["reciprocity"]) == 3
    assert all(0.5 < pair["ratio"] < 1.35 for pair in document["reciprocity"])
    assert document["verdict"]["trusted"] is not False
    page = (tmp_path / "report.html").read_text("utf-8")
    for file in (recorded / "robot.yaml", recorded / "recorded" / "plan.yaml", recorded / "recorded" / LOG):
        assert sha256_of(file) in page, file
    assert run("report", tmp_path).status == 0
    assert (tmp_path / "report.html").read_text("utf-8") == page


def test_one_realisation_takes_the_local_polynomial_method(
    run, recorded: Path, responses: Path, tmp_path: Path
) -> None:
    """Averages refuse it and say what does not; the response is that of three realisations, within its uncertainty."""
    folder = copied(recorded / "recorded", tmp_path / "recorded")
    plan = read_plan_of(folder / "plan.yaml", MultisinePlan)
    write_plan(folder / "plan.yaml", replace(plan, realisations=1, settle_periods=0))
    arguments = ("identify", "response", recorded / "robot.yaml", folder, "--out", tmp_path / "responses")
    assert_refusal(refused_run(run, tmp_path, *arguments), "E-FRF-037")
    document = run(*arguments, "--method", "local-polynomial", "--json").document
    assert [entry["method"] for entry in document["responses"]] == ["local_polynomial"] * 2
    assert all(entry["relative_noise_std"] < entry["relative_std"] for entry in document["responses"])
    one, all_of_them = (
        FrequencyResponse.load(found / "response_pose_1.npz") for found in (tmp_path / "responses", responses)
    )
    axes = [0, 1, 2]
    apart = np.abs(one.response - all_of_them.response)[:, axes, axes]
    assert np.median(apart / one.std[:, axes, axes]) < 1.0


@pytest.mark.parametrize(
    "method", ["logarithmic", "harmonic", "h1", "joint-input-output", "errors-in-variables"]
)
def test_every_average_may_be_asked_for(run, recorded: Path, tmp_path: Path, method: str) -> None:
    arguments = ("identify", "response", recorded / "robot.yaml", recorded / "recorded", "--out", tmp_path)
    document = run(*arguments, "--method", method, "--json").document
    assert document["responses"][0]["method"] == method.replace("-", "_")
    assert FrequencyResponse.load(tmp_path / "response_pose_1.npz").average == method.replace("-", "_")


def test_stiffness(recorded: Path, stiff_robot: Path) -> None:
    """Nine springs from two poses and few lines: the intervals of what is identifiable hold the truth, within reason."""
    document = json.loads((stiff_robot / "stiffness.json").read_text("utf-8"))
    assert document["fit"]["reference_motion_modelled"] and document["fit"]["missing_poses"] == []
    truth = read_truth(recorded / "recorded" / "truth.yaml")
    pulls = []
    for joint, springs in document["stage1"]["stiffness"].items():
        assert set(springs) == {"drive", "bearing_x", "bearing_y"}
        for spring, found in springs.items():
            if found["identifiable"]:
                pulls.append((found["estimate"] - truth[f"{joint}.{spring}.stiffness"]) / found["std"])
    assert len(pulls) >= 5 and np.median(np.abs(pulls)) < 2
    assert RobotModel.from_yaml(stiff_robot / "robot.yaml").value("joint_1.drive.stiffness") == pytest.approx(
        document["parameters"]["joint_1.drive.stiffness"]["estimate"]
    )


def test_ways_of_the_paper(
    run,
    recorded: Path,
    responses: Path,
    stiff_robot: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The paper's weighting finds the same springs, to what two poses tell; a population may look for the start."""
    robot = recorded / "robot.yaml"
    stiffness = ("identify", "stiffness", robot, responses, "--json", "--out")
    usual = json.loads((stiff_robot / "stiffness.json").read_text("utf-8"))["parameters"]
    paper = run(*stiffness, tmp_path / "paper", "--weighting", "paper").document["parameters"]
    for name in ("joint_1.drive.stiffness", "joint_2.drive.stiffness", "joint_3.drive.stiffness"):
        difference = paper[name]["estimate"] - usual[name]["estimate"]
        assert 0 < abs(difference) < 2 * np.sqrt(paper[name]["std"] ** 2 - usual[name]["std"] ** 2), name
    asked: list[str] = []

    def find(
        self: PopulationSearch, robot: Any, responses: Any, parameters: Parameters, *_: Any
    ) -> np.ndarray:
        asked.append("population")
        return parameters.coordinates()

    monkeypatch.setattr(PopulationSearch, "find", find)
    outcome = run(*stiffness, tmp_path / "population", "--search", "population", "--weighting", "uniform")
    assert outcome.status == 0 and asked == ["population"]
    origin = read_estimates(tmp_path / "population" / "estimates.yaml")["stiffness"].provenance
    assert {key: value for key, value in origin.items() if key.startswith("option.")} == {
        "option.inertias_known": "False",
        "option.bearings": "after",
        "option.weighting": "uniform",
        "option.search": "population",
        "option.seed": "0",
    }
    inputs = {key.removeprefix("input.") for key in origin if key.startswith("input.")}
    assert inputs == {"robot.yaml", "tx90l.urdf", "plan.yaml", "response_pose_1.npz", "response_pose_2.npz"}


def test_stiffness_leaves_out_what_calibration_made_of_it(
    run, responses: Path, stiff_robot: Path, tmp_path: Path
) -> None:
    """A calibration afterwards, which re-estimates stiffness, must not change what the same responses say of it."""
    robot = Path(shutil.copytree(stiff_robot, tmp_path / "tx90l")) / "robot.yaml"
    first = json.loads((stiff_robot / "stiffness.json").read_text("utf-8"))["parameters"]
    run("design", "poses", robot, "--count", 30, "--candidates", 300, "--out", tmp_path / "poses.yaml")
    measured = ("measure", tmp_path / "poses.yaml", "--robot", robot, "--cell", "virtual", "--seed", 4)
    run(*measured, "--out", tmp_path / "poses")
    calibrated = run("calibrate", robot, tmp_path / "poses" / "poses.csv", "--json").document["parameters"]
    name = "joint_2.drive.stiffness"
    assert calibrated[name]["std"] < first[name]["std"]
    assert set(read_estimates(robot.parent / "estimates.yaml")) == {"stiffness", "calibration"}
    page = run("identify", "stiffness", robot, responses)
    assert page.status == 0
    assert "joint_3.bearing_y.stiffness" in page.out and "flexcal design poses" in page.out
    again = read_estimates(robot.parent / "estimates.yaml")["stiffness"].values
    assert again[name] == pytest.approx(first[name]["estimate"], rel=2e-2)
    assert again["link_3.mass"] == pytest.approx(first["link_3.mass"]["estimate"], rel=2e-2)


def test_stiffness_of_a_rigid_robot(run, responses: Path, ur5_folder: Path) -> None:
    arguments = ("identify", "stiffness", ur5_folder / "robot.yaml", responses)
    assert_refusal(refused_run(run, ur5_folder, *arguments), "E-STIFF-002")


def test_folder_without_responses(run, recorded: Path, tmp_path: Path) -> None:
    arguments = ("identify", "stiffness", recorded / "robot.yaml", tmp_path)
    assert_refusal(refused_run(run, tmp_path, *arguments), "E-RUN-049")


def alter_log(folder: Path, change: Callable[[pl.DataFrame], pl.DataFrame]) -> None:
    change(pl.read_parquet(folder / LOG)).write_parquet(folder / LOG)


LOGS = {
    "gap": (lambda f: pl.concat([f[:700], f[760:]]), ["E-LOG-011", "row 701", "0.061"]),
    "time runs backwards": (lambda f: pl.concat([f[:700], f[600:]]), ["E-LOG-017", "row 701"]),
    "time stands still": (lambda f: pl.concat([f[:700], *[f[699:700]] * 9, f[700:]]), ["E-LOG-018"]),
    "no time": (lambda f: f.drop("t"), ["E-TABLE-006", "t"]),
    "no torque": (lambda f: f.drop("tau2"), ["E-TABLE-006", "tau2"]),
    "five joints": (lambda f: f.drop("q6"), ["E-TABLE-007", "5", "6"]),
    "NaN": (lambda f: f.with_columns(q1=pl.when(pl.col("t") > 1).then(float("nan")).otherwise(pl.col("q1"))), ["E-TABLE-039", "q1"]),
    "degrees": (lambda f: f.with_columns(pl.col("^q.$") * (180 / np.pi)), ["E-TABLE-001", "degrees"]),
    "too short": (lambda f: f[:-500], ["E-FRF-010", "2500", "3000"]),
}  # fmt: skip


@pytest.mark.parametrize(("change", "refusal"), LOGS.values(), ids=LOGS.keys())
def test_bad_log(
    run, recorded: Path, tmp_path: Path, change: Callable[[pl.DataFrame], pl.DataFrame], refusal: list[str]
) -> None:
    folder = copied(recorded / "recorded", tmp_path / "recorded")
    alter_log(folder, change)
    arguments = ("identify", "response", recorded / "robot.yaml", folder, "--out", tmp_path / "responses")
    sentence = refused_run(run, tmp_path, *arguments)
    assert_refusal(sentence, *refusal)
    assert LOG in sentence


def test_missing_log(run, recorded: Path, tmp_path: Path) -> None:
    folder = copied(recorded / "recorded", tmp_path / "recorded")
    (folder / LOG).unlink()
    arguments = ("identify", "response", recorded / "robot.yaml", folder, "--out", tmp_path / "responses")
    assert_refusal(refused_run(run, tmp_path, *arguments), "E-EXP-001", f"{Path(LOG).stem}.csv")


def test_poses_are_no_frequency_experiment(run, recorded: Path, tmp_path: Path) -> None:
    robot = recorded / "robot.yaml"
    run("design", "poses", robot, "--random", "--count", 3, "--out", tmp_path / "poses.yaml")
    run(
        "measure",
        tmp_path / "poses.yaml",
        "--robot",
        robot,
        "--cell",
        "virtual",
        "--out",
        tmp_path / "measured",
    )
    arguments = ("identify", "response", robot, tmp_path / "measured", "--out", tmp_path / "responses")
    assert_refusal(refused_run(run, tmp_path, *arguments), "E-RUN-073", "calibrate")


def test_plan_of_another_robot(run, recorded: Path, ur5_folder: Path, tmp_path: Path) -> None:
    plan = read_plan_of(recorded / "small.yaml", MultisinePlan)
    shorter = replace(plan, poses=plan.poses[:, :5], kp=plan.kp[:5], kd=plan.kd[:5])
    write_plan(ur5_folder / "five.yaml", shorter)
    arguments = ("measure", ur5_folder / "five.yaml", "--cell", "virtual", "--out", tmp_path / "x")
    assert_refusal(refused_run(run, tmp_path, *arguments), "E-RUN-048", "5")


def test_truth_of_another_robot(run, recorded: Path, tmp_path: Path) -> None:
    (tmp_path / "truth.yaml").write_text("joint_9.offset: 0.001\n")
    arguments = ("measure", recorded / "small.yaml", "--cell", "virtual", "--truth", tmp_path / "truth.yaml")
    sentence = refused_run(run, tmp_path, *arguments, "--out", tmp_path / "out")
    assert_refusal(sentence, "E-CELL-030", "truth.yaml", "joint_9.offset")


@pytest.mark.parametrize("wrong", ["  rotor_inertia: [6.4, 0, 1.49, 0.53, 0.11, 0.087]", "  # none"])
def test_motor_without_rotor_inertia(
    run, recorded: Path, tx90l_folder: Path, wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = tx90l_folder / "robot.yaml"
    lines = [
        wrong if line.startswith("  rotor_inertia:") else line for line in robot.read_text().splitlines()
    ]
    robot.write_text("\n".join(lines) + "\n")
    monkeypatch.chdir(tx90l_folder)
    measure = ("measure", recorded / "small.yaml", "--robot", "robot.yaml", "--cell", "virtual", "--out", "m")
    sentence = refused_run(run, tx90l_folder, *measure)
    assert ("joint_2" in sentence) == ("6.4" in wrong)
    assert_refusal(sentence, "E-CELL-012")


WITHOUT_END = """
import sys, time
import flexcal.jobs.experiments.measurement as measurement
from flexcal.cli.main import main

measurement.write_results = lambda *_: time.sleep(1000)
sys.exit(main(sys.argv[1:]))
"""
"""`flexcal` whose measurement is at its last step for long: a signal is never too late."""


def test_interrupted_measurement_is_not_complete(recorded: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-c", WITHOUT_END]
    command += ["measure", recorded / "whole.yaml", "--cell", "virtual", "--out", tmp_path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None and process.stdout is not None
        assert process.stderr.readline().startswith("recording")
        process.send_signal(signal.SIGINT)
        rest = process.stderr.read()
        assert process.wait(PATIENCE) == 130
        assert "Traceback" not in rest and "interrupted" in rest
    assert not (tmp_path / "plan.yaml").exists()


def test_no_verb_reads_the_truth(
    run, recorded: Path, responses: Path, stiff_robot: Path, tmp_path: Path
) -> None:
    """With every truth.yaml in its place, and with none left: the estimates are the same byte by byte."""
    folder = copied(recorded, tmp_path / "tx90l")
    robot, poses = folder / "robot.yaml", folder / "poses"
    run("design", "poses", robot, "--random", "--count", 12, "--out", folder / "poses.yaml")
    run("measure", folder / "poses.yaml", "--cell", "virtual", "--seed", 4, "--out", poses)
    truths = [folder / "recorded" / "truth.yaml", poses / "truth.yaml"]
    assert read_truth(truths[0]) == read_truth(truths[1])

    def estimates(robot: Path, found: Path) -> list[bytes]:
        assert run("calibrate", robot, poses / "poses.csv", "--terms", "kinematic", "backlash").status == 0
        left = (
            robot.parent / "estimates.yaml",
            robot.parent / "estimates.npz",
            found / "response_pose_1.npz",
        )
        return [file.read_bytes() for file in left]

    told = estimates(
        Path(shutil.copytree(stiff_robot, tmp_path / "told" / "tx90l")) / "robot.yaml", responses
    )
    for truth in truths:
        truth.unlink()
    for step in (
        ("response", robot, folder / "recorded", "--out", folder / "responses"),
        ("stiffness", robot, folder / "responses"),
    ):
        assert run("identify", *step).status == 0
    assert estimates(robot, folder / "responses") == told


def test_a_pose_without_response_is_named(run, recorded: Path, responses: Path, tmp_path: Path) -> None:
    robot = copied(recorded, tmp_path / "tx90l") / "robot.yaml"
    shutil.copytree(responses, tmp_path / "responses")
    (tmp_path / "responses" / "response_pose_1.npz").unlink()
    done = run("identify", "stiffness", robot, tmp_path / "responses")
    assert done.status == 0 and "poses of the plan without a response, not used in the fit: 1" in done.out


def test_a_plan_asks_for_everything_at_once(tx90l_folder: Path, capsys) -> None:
    robot = tx90l_folder / "robot.yaml"
    text = robot.read_text("utf-8")
    robot.write_text(
        "".join(line for line in text.splitlines(True) if not line.startswith("controller")), "utf-8"
    )
    (tx90l_folder / "frequency_poses.csv").unlink(missing_ok=True)
    assert main(["design", "frequency", str(robot), "--out", str(tx90l_folder / "plan.yaml")]) == 2
    said = capsys.readouterr().err
    assert_refusal(said, "E-RUN-038", "frequency_poses.csv", "--plan designed")
