"""`export excitation`, and `measure` with recordings: of a robot in closed form that knows the written files alone."""

from __future__ import annotations

import csv
import hashlib
import re
import shutil
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest
import yaml
from mcap_messages import trajectory_in
from played_robot import KD, KP, ROBOT, STEPS, URDF, Log, Robot, Stepped, gravity
from refusals import assert_refusal

from flexcal import MultisinePlan, PlayedSignal, RobotModel, played_signals
from flexcal.cli.main import main
from flexcal.data.plans import read_plan_of, write_plan
from flexcal.design.frequency import signal_uses

NAMES = [f"{kind}{j}" for kind in ("q", "dq", "tau") for j in (1, 2)]


def plan_of(**changes: object) -> MultisinePlan:
    lines = np.arange(3, 60, 2)
    values: dict = {
        "name": "fence",
        "poses": np.array([[-0.3, 0.5], [-1.0, 1.6]]),
        "joints": (0, 1),
        "base_frequency_hz": 1.0,
        "lines": lines,
        "amplitude": np.repeat([[3.0], [1.5]], len(lines), axis=1),
        "periods": 3,
        "settle_periods": 1,
        "realisations": 3,
        "signs": True,
        "reference_amplitude": 0.02,
        "reference_frequency_hz": 1.5,
        "kp": np.array(KP),
        "kd": np.array(KD),
        "rate_hz": 1000.0,
        "torque": "held",
        "seed": 3,
    }
    return MultisinePlan(**(values | changes))


def project(folder: Path, **changes: object) -> Path:
    """A folder with the robot and its plan."""
    folder.mkdir(exist_ok=True)
    (folder / "fence.urdf").write_text(URDF)
    (folder / "robot.yaml").write_text(ROBOT)
    write_plan(folder / "frequency.yaml", plan_of(**changes))
    return folder


def manifest(folder: Path, name: str = "manifest.csv") -> list[dict[str, str]]:
    with (folder / name).open() as stream:
        return list(csv.DictReader(stream))


def multisine(folder: Path, row: dict[str, str], time: np.ndarray) -> np.ndarray:
    """Torques (N, 2) of a row of the manifest by phases.csv alone, at times from the begin of the periods on."""
    phases = pl.read_csv(folder / "phases.csv")
    result = np.zeros((len(time), 2))
    for joint in (1, 2):
        mine = phases.filter(
            (pl.col("realisation") == int(row["realisation"]))
            & (pl.col("experiment") == int(row["experiment"]))
            & (pl.col("joint") == joint)
        )
        angle = 2 * np.pi * time[:, None] * mine["frequency_hz"].to_numpy() + mine["phase_rad"].to_numpy()
        result[:, joint - 1] = int(row["sign"]) * np.cos(angle) @ mine["amplitude"].to_numpy()
    return result


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Log]:
    folder = project(tmp_path_factory.mktemp("played") / "fence")
    export = ["export", "excitation", folder / "frequency.yaml", "--out", folder / "excitation"]
    assert main([str(word) for word in export]) == 0
    return folder, Robot().play(folder / "excitation", before=0.5)


def test_the_measured_part_is_the_plan_s_multisine(cell: tuple[Path, Log]) -> None:
    folder = cell[0] / "excitation"
    plan = read_plan_of(folder / "plan.yaml", MultisinePlan)
    rows = manifest(folder)
    assert len(rows) == 24 and len({row["file"] for row in rows}) == 24
    first = list(rows[0])[:9]
    assert first == ["file", "pose", "realisation", "experiment", "sign", "rate_hz", "start_s", "period_s", "periods"]  # fmt: skip
    spectra = {}
    for row in rows:
        file = folder / row["file"]
        assert row["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
        table = pl.read_csv(file)
        assert table.columns == ["t", *NAMES]
        assert float(row["start_s"]) == 2.0 and float(row["period_s"]) == 1.0 and row["periods"] == "2"
        begin, length = int(row["loop_start_row"]), int(row["loop_rows"])
        assert length == 2000  # the reference motion repeats itself after two periods
        loop = table[begin : begin + length]
        values = loop.select("tau1", "tau2").to_numpy()
        exact = multisine(folder, row, loop["t"].to_numpy() - loop["t"][0])
        assert np.abs(values - exact).max() < 1e-6 * np.abs(exact).max()
        bins = np.fft.rfft(values, axis=0) / len(values) * 2
        off = np.delete(bins, 2 * plan.lines, axis=0)
        assert np.abs(off).max() < 1e-6 * np.abs(bins).max()
        key = row["pose"], row["realisation"], row["sign"]
        spectra.setdefault(key, []).append(bins[2 * plan.lines])
    for (pose, realisation, sign), columns in spectra.items():
        gamma = np.stack(columns, axis=2)  # (L, axes, experiments), eq. (25)
        product = gamma @ gamma.conj().transpose(0, 2, 1)
        assert np.allclose(product, np.diag([9.0, 2.25]), atol=1e-6)
        assert np.allclose(
            gamma, (1 if sign == "1" else -1) * np.stack(spectra["1", realisation, "1"], axis=2)
        )
        assert pose in "12"


def test_from_rest_to_rest_and_on_to_the_next_pose(cell: tuple[Path, Log]) -> None:
    folder = cell[0] / "excitation"
    plan = read_plan_of(folder / "plan.yaml", MultisinePlan)
    for signal in played_signals(plan):
        assert isinstance(signal, PlayedSignal)
        for end in (0, -1):
            assert np.array_equal(signal.position[end], plan.poses[signal.pose])
            assert not signal.velocity[end].any() and not signal.torque[end].any()
        numeric = (signal.position[2:] - signal.position[:-2]) * 500
        assert np.abs(signal.velocity[1:-1] - numeric).max() < 1e-4 * np.abs(numeric).max()
        assert np.abs(signal.position - plan.poses[signal.pose]).max() == pytest.approx(0.02, rel=1e-3)
    (row,) = manifest(folder, "moves.csv")
    move = pl.read_csv(folder / row["file"])
    q, dq = move.select("q1", "q2").to_numpy(), move.select("dq1", "dq2").to_numpy()
    assert np.allclose(q[[0, -1]], plan.poses) and not dq[[0, -1]].any()
    assert np.abs(dq).max() <= 0.9 * 1.001
    assert np.allclose(np.diff(q, axis=0) * 1000, (dq[1:] + dq[:-1]) / 2, atol=1e-4)


def test_whole_signals_are_those_of_the_loops(run, cell: tuple[Path, Log], tmp_path: Path) -> None:
    folder = cell[0]
    asked = ("--out", tmp_path / "whole", "--whole", "--format", "parquet")
    assert run("export", "excitation", folder / "frequency.yaml", *asked).status == 0
    for short, long in zip(manifest(folder / "excitation"), manifest(tmp_path / "whole"), strict=True):
        table = pl.read_csv(folder / "excitation" / short["file"]).to_numpy()
        begin, length, play = (int(short[key]) for key in ("loop_start_row", "loop_rows", "play_rows"))
        order = [*range(begin), *(begin + np.arange(play) % length), *range(begin + length, len(table))]
        every = pl.read_parquet(tmp_path / "whole" / long["file"]).to_numpy()
        assert np.allclose(every[:, 1:], table[order, 1:], atol=1e-8)
        assert np.allclose(every[:, 0], np.arange(len(order)) / 1000)
        assert float(long["play_s"]) == pytest.approx(len(order) / 1000)


def test_a_period_that_is_no_whole_number_of_samples(run, tmp_path: Path) -> None:
    """Every sample is that of the multisine; what it costs is said."""
    folder = project(tmp_path / "odd", base_frequency_hz=0.7, reference_frequency_hz=1.05)
    outcome = run(
        "export", "excitation", folder / "frequency.yaml", "--out", folder / "played", "--rate", 997
    )
    assert outcome.status == 0
    assert "1424.29 samples at 997 Hz" in outcome.out and "996.8 or 997.5 Hz" in outcome.out
    for row in manifest(folder / "played")[:4]:
        table = pl.read_csv(folder / "played" / row["file"])
        begin, length = int(row["loop_start_row"]), int(row["play_rows"])
        time = np.arange(length) / 997
        values = table[begin : begin + length].select("tau1", "tau2").to_numpy()
        exact = multisine(folder / "played", row, time)
        assert np.abs(values - exact).max() < 1e-6 * np.abs(exact).max()
        assert len(table) == length + 2 * begin and float(row["start_s"]) == pytest.approx(
            begin / 997 + 1 / 0.7
        )


STIFFNESS = {"j1": 9000.0, "j2": 4000.0}


def assert_stiffness(run, folder: Path) -> None:
    """Responses and stiffnesses of the recordings in `frequency` are the robot's."""
    robot = folder / "robot.yaml"
    assert run("identify", "response", robot, folder / "frequency", "--out", folder / "responses").status == 0
    found = run("identify", "stiffness", robot, folder / "responses", "--json").document["stage1"][
        "stiffness"
    ]
    for joint, true in STIFFNESS.items():
        value = found[joint]["drive"]
        assert value["estimate"] == pytest.approx(true, rel=0.01)
        assert abs(value["estimate"] - true) < 3 * value["std"]


@pytest.mark.parametrize(
    "log",
    [
        {"by_hand": 1},
        pytest.param({"every": 2, "late": 1, "by_hand": 2}, marks=pytest.mark.slow),
        {"every": 5, "late": 3, "clock": 1.0001},
    ],
)
def test_round_trip(run, cell: tuple[Path, Log], tmp_path: Path, log: dict[str, Any]) -> None:
    """Written files, a robot that reads them alone, its logs, responses, stiffnesses."""
    folder = shutil.copytree(cell[0], tmp_path / "fence")
    cell[1].write(folder / "logs", **log)
    exchanged = sorted((folder / "logs").iterdir())[3], sorted((folder / "logs").iterdir())[16]
    exchanged[0].rename(folder / "logs" / "aside")
    exchanged[1].rename(exchanged[0])
    (folder / "logs" / "aside").rename(exchanged[1])
    robot = folder / "robot.yaml"
    arguments = ("--robot", robot, "--cell", folder / "logs", "--out", folder / "frequency", "--json")
    outcome = run("measure", folder / "excitation" / "plan.yaml", *arguments)
    assert outcome.status == 0
    remark, *more = outcome.document["remarks"]
    slow, drift = (
        any(words in text for text in more) for words in ("held for 1/1000 s", "in a million: corrected")
    )
    assert (slow, drift) == ("clock" in log, "clock" in log) and len(more) == slow + drift
    for entry in outcome.document["found"]:
        assert entry["correlation"] > 0.7 and entry["clock_ppm"] == pytest.approx(
            1e6 * (log.get("clock", 1) - 1), abs=2
        )
    assert remark.startswith("logs are taken as what they hold, not by their names: ")
    assert exchanged[0].name in remark and exchanged[1].stem in remark
    one = pl.read_parquet(folder / "frequency" / "pose_1_realisation_1_experiment_1_plus.parquet")
    rate = STEPS * 1000 / log.get("every", STEPS)
    assert len(one) == 3 * max(1000, rate)
    assert_stiffness(run, folder)


def test_round_trip_of_a_position_controlled_robot(run, tmp_path: Path) -> None:
    """It takes no torques, and its controller is not the assumed one."""
    folder = project(tmp_path / "fence")
    asked = ("--bandwidth", 4, "--out", folder / "excitation", "--json")
    outcome = run("export", "excitation", folder / "frequency.yaml", *asked)
    assert {"the commanded position", "the commanded velocity"} <= {
        use["what"] for use in outcome.document["limits"]
    }
    table = pl.read_csv(folder / "excitation" / "pose_1_realisation_1_experiment_1_plus.csv")
    assert table.columns == ["t", "q1", "q2", "dq1", "dq2"]
    q, dq = table["q1"].to_numpy()[:3000], table["dq1"].to_numpy()[:3000]
    assert np.abs(np.diff(q) * 1000 - (dq[1:] + dq[:-1]) / 2).max() < 0.01 * np.abs(dq).max()
    Robot(kp=(1700.0, 250.0), kd=(60.0, 22.0)).play(folder / "excitation", before=0.5).write(
        folder / "logs", by_hand=4
    )
    shutil.copy(folder / "excitation" / "plan.yaml", folder / "logs")
    arguments = ("--cell", folder / "logs", "--out", folder / "frequency")
    assert run("measure", folder / "frequency.yaml", *arguments).status == 0
    assert_stiffness(run, folder)


@pytest.fixture(scope="module")
def player(root: Path) -> Any:
    """The example of a program that plays the files."""
    spec = spec_from_file_location("play", root / "examples" / "excitation_player" / "play.py")
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    sys.modules["play"] = module  # dataclasses look there
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four signals of 3 s, and a move."""
    lines = np.arange(3, 30, 2)
    few = {"lines": lines, "amplitude": np.repeat([[4.0], [2.0]], len(lines), axis=1)}
    poses = np.array([[-0.3, 0.5], [-0.5, 0.7]])
    schedule = {
        "base_frequency_hz": 2.0,
        "reference_frequency_hz": 3.0,
        "periods": 2,
        "realisations": 1,
        "signs": False,
    }
    folder = project(tmp_path_factory.mktemp("short") / "fence", poses=poses, **few, **schedule)
    export = ["export", "excitation", folder / "frequency.yaml", "--out", folder / "excitation"]
    assert main([str(word) for word in export]) == 0
    return folder


def test_the_example_plays_all_files_and_logs_them(run, player: Any, short: Path, tmp_path: Path) -> None:
    robot = Robot(noise=(0.0, 0.0))
    hold = player.Hold(gravity, np.array(KP), np.array(KD))
    player.play_all(short / "excitation", tmp_path / "logs", Stepped(robot, np.array([-0.3, 0.5])), hold)
    first = robot.play(short / "excitation")
    log = pl.read_csv(tmp_path / "logs" / first.names[0]).to_numpy()
    expected = np.column_stack([first.q[::STEPS, 0], first.tau[::STEPS, 0]])
    assert np.abs(log[:, 1:] - expected).max() < 1e-6
    cell = ("--cell", tmp_path / "logs", "--out", tmp_path / "frequency", "--json")
    outcome = run("measure", short / "excitation" / "plan.yaml", "--robot", short / "robot.yaml", *cell)
    assert outcome.document["recordings"] == 4 and outcome.document["remarks"] == []


def test_the_example_under_ros2_control(player: Any, short: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By topics whose names and messages are ROS's, of a robot of which every message is a cycle."""
    for name, message in (("sensor_msgs", "JointState"), ("std_msgs", "Float64MultiArray")):
        module = ModuleType(f"{name}.msg")
        setattr(module, message, SimpleNamespace)
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
        monkeypatch.setitem(sys.modules, f"{name}.msg", module)
    received: list = []

    def node(robot: Stepped) -> SimpleNamespace:
        def publisher(_: type, topic: str, __: int) -> SimpleNamespace:
            assert topic == "/effort_controller/commands"
            return SimpleNamespace(publish=lambda message: robot.write(np.array(message.data)[::-1]))

        return SimpleNamespace(
            create_publisher=publisher, create_subscription=lambda *x: received.append(x[2])
        )

    def spin() -> None:
        position, velocity, effort = (values[::-1].tolist() for values in robot.read())
        state = SimpleNamespace(
            name=["j1", "j2"], position=position[::-1], velocity=velocity[::-1], effort=effort[::-1]
        )
        received[0](state)

    row = manifest(short / "excitation")[0]
    file = short / "excitation" / row["file"]
    hold = player.Hold(lambda q: gravity(q[::-1])[::-1], np.array(KP)[::-1], np.array(KD)[::-1])
    robot = Stepped(Robot(), np.array([-0.3, 0.5]))
    ros = player.RosEffort(node(robot), spin, ["j2", "j1"], "/effort_controller/commands")
    for number, (q, dq, added) in enumerate(player.signal(file, row)):
        at, speed, _ = ros.read()
        ros.write(hold.torque(q[::-1], dq[::-1], at, speed) + added[::-1])
        if number == 1500:
            break
    other = Stepped(Robot(), np.array([-0.3, 0.5]))
    usual = player.Hold(gravity, np.array(KP), np.array(KD))
    for _, (q, dq, added) in zip(range(1501), player.signal(file, row), strict=False):
        at, speed, _ = other.read()
        other.write(usual.torque(q, dq, at, speed) + added)
    assert np.abs(robot.state - other.state).max() < 1e-9 and np.abs(robot.state[0, 4:6]).max() > 0.01


def test_the_example_with_a_robot_of_positions(player: Any, short: Path, tmp_path: Path, run) -> None:
    asked = ("--bandwidth", 4, "--out", tmp_path / "positions", "--robot", short / "robot.yaml")
    assert run("export", "excitation", short / "frequency.yaml", *asked).status == 0
    row = manifest(tmp_path / "positions")[0]
    robot = Stepped(Robot(kp=(1500.0, 350.0), kd=(80.0, 20.0)), np.array([-0.3, 0.5]), positions=True)
    log = player.play(tmp_path / "positions" / row["file"], row, robot, None)
    q, tau = log[1000:2000, 1:3], log[1000:2000, 3:]
    assert 0.9 < np.abs(q - [-0.3, 0.5]).max() / 0.02 < 1.6
    bins = np.fft.rfft(tau, axis=0)[2 * np.arange(3, 30, 2)] / 500
    asked_for = np.array([4.0, 2.0]) / np.sqrt(2)
    assert np.all(np.abs(np.abs(bins) / asked_for - 1).mean(axis=0) < 0.35)


def test_messages_of_ros(run, tmp_path: Path) -> None:
    plan = {"periods": 2, "realisations": 1, "poses": np.array([[-0.3, 0.5], [-0.5, 0.6]])}
    folder = project(tmp_path / "fence", **plan)
    asked = ("--format", "ros", "--rate", 200, "--out", folder / "ros")
    assert run("export", "excitation", folder / "frequency.yaml", *asked).status == 0
    played = read_plan_of(folder / "ros" / "plan.yaml", MultisinePlan)
    rows = manifest(folder / "ros")
    for signal, row in zip(played_signals(played), rows, strict=True):
        message = yaml.safe_load((folder / "ros" / row["file"]).read_text())
        assert message["joint_names"] == ["j1", "j2"] and row["loop_rows"] == row["play_rows"]
        quantities = (
            ("positions", signal.position),
            ("velocities", signal.velocity),
            ("effort", signal.torque),
        )
        for key, values in quantities:
            assert np.allclose([point[key] for point in message["points"]], values, atol=1e-9)
        stamps = [point["time_from_start"] for point in message["points"]]
        assert np.allclose([at["sec"] + 1e-9 * at["nanosec"] for at in stamps], signal.time, atol=1e-9)
    (move,) = manifest(folder / "ros", "moves.csv")
    assert "effort" not in yaml.safe_load((folder / "ros" / move["file"]).read_text())["points"][0]


def test_messages_of_ros_in_mcap_files(run, tmp_path: Path) -> None:
    folder = project(tmp_path / "fence", periods=2, realisations=1)
    asked = ("export", "excitation", folder / "frequency.yaml", "--rate", 200)
    for kind in ("ros", "mcap"):
        assert run(*asked, "--format", kind, "--out", folder / kind).status == 0
    for name in ("manifest.csv", "moves.csv"):
        for text, packed in zip(manifest(folder / "ros", name), manifest(folder / "mcap", name), strict=True):
            file = folder / "mcap" / packed["file"]
            assert packed["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
            said = yaml.safe_load((folder / "ros" / text["file"]).read_text())
            heard = trajectory_in(file)
            assert heard.joint_names == said["joint_names"]
            for one, other in zip(heard.points, said["points"], strict=True):
                for key in ("positions", "velocities", "accelerations", "effort"):
                    assert np.allclose(getattr(one, key), other.get(key, []), rtol=0, atol=1e-9)
                at = {"sec": one.time_from_start.sec, "nanosec": one.time_from_start.nanosec}
                assert at == other["time_from_start"]


def test_currents_where_the_torque_constants_are_known(run, tmp_path: Path) -> None:
    folder = project(tmp_path / "fence", periods=2, realisations=1)
    with (folder / "robot.yaml").open("a") as file:
        file.write("signals: {tau: {columns: [a, b], gain: [20.0, 8.0], unit: A}}\n")
    out = folder / "played"
    assert run("export", "excitation", folder / "frequency.yaml", "--out", out).status == 0
    table = pl.read_csv(out / manifest(out)[0]["file"])
    assert np.allclose(table["i1"] * 20, table["tau1"], atol=1e-7)
    assert np.allclose(table["i2"] * 8, table["tau2"], atol=1e-7)


def test_recordings_that_are_missing_or_there_twice(run, cell: tuple[Path, Log], tmp_path: Path) -> None:
    folder = cell[0]
    cell[1].write(tmp_path / "logs")
    files = sorted((tmp_path / "logs").iterdir())
    arguments = ("--robot", folder / "robot.yaml", "--cell", tmp_path / "logs", "--out", tmp_path / "out")
    measure = ("measure", folder / "excitation" / "plan.yaml", *arguments)
    files[5].rename(tmp_path / "aside")
    assert_refusal(run(*measure).err, "E-EXP-019", "1 of 24", files[5].stem)
    shutil.copy(files[7], files[5])
    assert_refusal(run(*measure).err, "E-EXP-018", files[7].name, files[5].name)
    table = pl.read_csv(tmp_path / "aside")
    table[1900:].write_csv(files[5])
    assert_refusal(run(*measure).err, "E-EXP-017", files[5].name, "begins")
    table.with_columns(tau1=-pl.col("tau2"), tau2=pl.col("tau1")).write_csv(files[5])
    assert_refusal(run(*measure).err, "E-EXP-014", files[5].name)
    table.with_columns(q1=pl.col("q1") + 0.4).write_csv(files[5])
    assert_refusal(run(*measure).err, "E-EXP-016", files[5].name, "joint 1")
    table[: 500 + 2000].write_csv(files[5])
    assert_refusal(run(*measure).err, "E-EXP-013", files[5].name)
    table[::8].write_csv(files[5])
    assert_refusal(run(*measure).err, "E-EXP-027", files[5].name, "125", "59", "147.5")
    assert not (tmp_path / "out").exists()


def test_a_torque_of_the_wrong_sign_is_no_exchange_of_names(
    run, cell: tuple[Path, Log], tmp_path: Path
) -> None:
    """With two axes it makes one orthogonal experiment of the other."""
    cell[1].write(tmp_path / "logs")
    for file in (tmp_path / "logs").iterdir():
        pl.read_csv(file).with_columns(tau2=-pl.col("tau2")).write_csv(file)
    cells = ("--cell", tmp_path / "logs", "--out", tmp_path / "out", "--robot", cell[0] / "robot.yaml")
    outcome = run("measure", cell[0] / "excitation" / "plan.yaml", *cells)
    assert_refusal(outcome.err, "E-EXP-028", "24 of 24", "tau")


def test_the_manifest_says_how_long_a_torque_is_held(run, short: Path, tmp_path: Path) -> None:
    """The plan was for 1 kHz, and is played at 500 Hz."""
    asked = ("--rate", 500, "--robot", short / "robot.yaml", "--out", tmp_path / "slow", "--whole")
    assert run("export", "excitation", short / "frequency.yaml", *asked).status == 0
    shutil.copytree(
        tmp_path / "slow", tmp_path / "logs", ignore=shutil.ignore_patterns("plan.yaml", ".flexcal", "move*")
    )
    for row in manifest(tmp_path / "slow"):
        table = pl.read_csv(tmp_path / "slow" / row["file"]).select("t", "q1", "q2", "tau1", "tau2")
        table.write_csv(tmp_path / "logs" / row["file"])
    cells = ("--cell", tmp_path / "logs", "--robot", short / "robot.yaml")
    assert (
        run("measure", short / "frequency.yaml", *cells, "--out", tmp_path / "a", "--json").document[
            "remarks"
        ]
        == []
    )
    assert read_plan_of(tmp_path / "a" / "plan.yaml", MultisinePlan).rate_hz == 500
    (tmp_path / "logs" / "manifest.csv").unlink()
    outcome = run("measure", short / "frequency.yaml", *cells, "--out", tmp_path / "b", "--json")
    assert "held for 1/1000 s" in outcome.document["remarks"][0]
    (tmp_path / "logs" / "manifest.csv").write_text("file,pose\na.csv,1\n")
    assert_refusal(
        run("measure", short / "frequency.yaml", *cells, "--out", tmp_path / "c").err, "E-EXP-029", "rate_hz"
    )


def test_plans_that_are_too_long(run, tmp_path: Path) -> None:
    folder = project(tmp_path / "fence", periods=50_000)
    outcome = run("export", "excitation", folder / "frequency.yaml", "--out", folder / "played")
    assert_refusal(outcome.err, "E-EXP-026", "fence", "59")


def test_limits_are_what_the_robot_does(cell: tuple[Path, Log], tmp_path: Path) -> None:
    """Torque, position and load of a spring along the signals at their largest, against the robot that played them."""
    folder = shutil.copytree(cell[0], tmp_path / "fence", ignore=shutil.ignore_patterns("excitation"))
    true = ROBOT.replace("14000.0", "9000.0").replace("6000.0", "4000.0")
    (folder / "robot.yaml").write_text(true + "geometry: {backlash: [j1, j2]}\n")
    plan = read_plan_of(folder / "frequency.yaml", MultisinePlan)
    uses = {
        what: vars(use)
        for what, use in signal_uses(RobotModel.from_yaml(folder / "robot.yaml"), plan).items()
    }
    log = cell[1]
    signs = np.array(["plus" in name for name in log.names])
    spring = np.array(STIFFNESS["j1"]), np.array(STIFFNESS["j2"])
    load = np.stack(spring) * (log.q - log.arm)
    of_excitation = (load[:, signs] - load[:, ~signs]) / 2
    q = np.repeat([[[-0.3, 0.5]], [[-1.0, 1.6]]], 12, axis=0).reshape(24, 2)
    preload = np.abs(gravity(q - gravity(q) / np.stack(spring)))
    measured = {
        "the torque": np.abs(log.tau) / [300.0, 150.0],
        "the motor position": np.abs(log.q) / 3.0,
        "the position of the deflected arm": np.abs(log.arm) / 3.0,
        "the torque by the excitation in the preloaded drive": np.abs(of_excitation) / preload[signs],
    }
    for what, share in measured.items():
        assert uses[what]["share"] == pytest.approx(share.max(), rel=0.03), what
        joint = int(share.max(axis=(0, 1)).argmax())
        assert uses[what]["joint"] == ("j1", "j2")[joint]
    # a controller without feed-forward of the acceleration overshoots the reference motion: the excitation's part and the commanded one
    rate = (log.q[6004:18004] - log.q[5996:17996]) * 500
    swung = (rate[:, signs] - rate[:, ~signs]) / 2
    commanded = 0.02 * 3 * np.pi * np.cos(3 * np.pi * np.arange(12000) / 4000)[:, None, None]
    fastest = max(np.abs(commanded + swung).max(), np.abs(commanded - swung).max())
    assert uses["the velocity"]["share"] == pytest.approx(fastest / 9, rel=0.05)


@pytest.mark.parametrize(
    ("limit", "changed", "named"),
    [
        ('effort="300"', 'effort="55"', ["the torque of j1", "55", "--scale"]),
        ('velocity="9"', 'velocity="0.25"', ["the velocity of", "0.25", "--scale"]),
        ('upper="3" effort="150"', 'upper="1.63" effort="150"', ["of j2", "pose 2", "1.63", "--scale"]),
        ('upper="3" effort="150"', 'upper="1.61" effort="150"', ["of j2", "pose 2", "1.61", "no --scale helps"]),
        ("prior:", "limits: {speed: 0.3}\nprior:", ["the speed of the point 'tip'", "beyond 0.3;", "--scale"]),
        ("prior:", "limits: {box: {lower: [-1, -1, 0.02], upper: [1, 1, 1]}}\nprior:", ["the reach of the point 'tip' along z", "0.02;"]),
        ("prior:", "geometry: {backlash: [j2]}\nprior:", ["the torque by the excitation in the preloaded drive of j2", "--scale"]),
    ],
)  # fmt: skip
def test_a_limit_that_would_be_passed(
    run, tmp_path: Path, limit: str, changed: str, named: list[str]
) -> None:
    """It is named, nothing is written, and what is proposed is enough."""
    folder = project(tmp_path / "fence", amplitude=np.repeat([[5.0], [2.5]], 29, axis=1))
    for file in ("fence.urdf", "robot.yaml"):
        text = (folder / file).read_text()
        (folder / file).write_text(text.replace(limit, changed))
    export = ("export", "excitation", folder / "frequency.yaml", "--out", folder / "played")
    outcome = run(*export)
    assert outcome.status == 2 and outcome.err.rstrip().endswith("[E-EXP-022]")
    for words in named:
        assert words in outcome.err
    assert not (folder / "played").exists()
    proposed = re.search(r"give --scale (\d+\.\d+)\.", outcome.err)
    if proposed is not None:
        again = run(*export, "--scale", proposed[1], "--json")
        assert again.status == 0
        assert 0.97 < max(use["share"] for use in again.document["limits"]) <= 1
        amplitude = read_plan_of(folder / "played" / "plan.yaml", MultisinePlan).amplitude
        assert np.allclose(amplitude[:, 0], float(proposed[1]) * np.array([5.0, 2.5]))
