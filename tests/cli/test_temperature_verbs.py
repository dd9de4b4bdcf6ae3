"""Verbs with the temperature of the arm: from a column, from --temperature, or neither."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from cli_files import read_csv
from dh_arm import DHArm, postures, tracked, write_robot
from refusals import assert_refusal
from thermal_arm import ThermalArm, cycling, sensed, write_warm_poses

from flexcal.cli.main import main
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest

WARM = 31.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An arm that grows, calibrated over 12 K, and eight poses at 31 °C, exact but for the tracker's place."""
    folder, rng = tmp_path_factory.mktemp("warm"), np.random.default_rng(4)
    robot, arm, time = write_robot(folder), ThermalArm(DHArm.made(4)), np.linspace(0, 10800, 50)
    robot.write_text(robot.read_text().replace("[kinematic]", "[kinematic, thermal]"))
    q, others = postures(rng, 50), postures(rng, 8)
    temperature = np.concatenate([cycling(time), np.full(8, WARM)])
    seen = tracked(arm.points(np.concatenate([q, others]), temperature), rng, 0.0)
    noisy = seen[:50] + 2e-5 * rng.normal(size=(50, 3))
    write_warm_poses(folder / "poses.csv", q, noisy, 2e-5, sensed(time, temperature[:50], rng), time)
    write_warm_poses(folder / "warm.csv", others, seen[50:], 2e-5, temperature[50:])
    write_warm_poses(folder / "blind.csv", others, seen[50:], 2e-5)
    lines = [line.split(",") for line in (folder / "blind.csv").read_text().splitlines()]
    (folder / "targets.csv").write_text("\n".join(",".join(line[:7]) for line in lines) + "\n")
    assert main(["calibrate", str(robot), str(folder / "poses.csv")]) == 0
    return folder


def test_verify_takes_it_from_the_column_or_the_option(folder: Path, run: Callable) -> None:
    robot = folder / "robot.yaml"
    column = run("verify", robot, folder / "warm.csv", "--json").document
    option = run("verify", robot, folder / "blind.csv", "--temperature", WARM, "--json").document
    neither = run("verify", robot, folder / "blind.csv", "--json").document
    errors = [d["verification"]["measured"]["mean_mm"] for d in (column, option, neither)]
    assert errors[0] == errors[1] < 0.7 * errors[2]
    assert any("no temperature is given" in text for text in neither["remarks"])
    refused = run("verify", robot, folder / "warm.csv", "--temperature", WARM)
    assert_refusal(refused.err, "E-RUN-109", "temperature")


def test_commands_and_the_tool_they_bring_to_its_targets(folder: Path, tmp_path: Path, run: Callable) -> None:
    """What compensate makes for 31 °C, predict finds there at 31 °C and elsewhere at 20 °C."""
    robot, commands = folder / "robot.yaml", tmp_path / "commands.csv"
    done = run("compensate", robot, folder / "targets.csv", "--temperature", WARM, "--out", commands)
    assert done.status == 0 and read_csv_names(commands)[-2:] == ["temperature", "unambiguous"]
    places = {}
    for name, source in (("with", commands), ("targets", folder / "targets.csv")):
        run("predict", robot, source, "--out", tmp_path / f"{name}.csv")
        places[name] = xyz(tmp_path / f"{name}.csv")
    nominal = RobotModel.from_yaml(robot, estimates=False)
    header, rows = read_csv(folder / "targets.csv")
    aim = tool_at_rest(nominal, rows[:, 1:7], None, np.full(len(rows), "smr")).kinematics.position
    away = np.linalg.norm(places["with"] - aim, axis=1)
    # the measured point is compensated where it was found on the tool, some mm from where it is declared
    assert away.max() < 5e-3 and header[0] == "pose"
    far = run("predict", robot, folder / "targets.csv", "--temperature", 80.0, "--out", tmp_path / "far.csv")
    assert "outside those of the calibration" in far.out
    grown = np.linalg.norm(xyz(tmp_path / "far.csv"), axis=1) / np.linalg.norm(places["targets"], axis=1) - 1
    model = RobotModel.from_yaml(robot)
    rise = 80.0 - model.value("thermal.reference")
    np.testing.assert_allclose(grown, model.value("thermal.expansion") * rise, rtol=1e-4)


def test_an_exported_urdf_is_for_one_temperature(folder: Path, tmp_path: Path, run: Callable) -> None:
    """The link of its point is farther from the base where the arm is warm."""
    robot = folder / "robot.yaml"
    model = RobotModel.from_yaml(robot)
    q, places = read_csv(folder / "targets.csv")[1][:, 1:7], {}
    for at in (20.0, WARM):
        out = tmp_path / f"{at:.0f}" / "robot.urdf"
        out.parent.mkdir()
        done = run("export", "urdf", robot, "--temperature", at, "--out", out)
        assert done.status == 0 and f"as it is at {at:.1f} °C" in done.out
        (out.parent / "robot.yaml").write_text(
            "robot: robot.urdf\npoints: {ball: {frame: smr, xyz: [0, 0, 0]}}\n"
        )
        read = RobotModel.from_yaml(out.parent / "robot.yaml", estimates=False)
        places[at] = tool_at_rest(read, q, None, np.full(len(q), "ball")).kinematics.position
    growth = model.value("thermal.expansion") * (WARM - 20.0)
    assert np.abs(places[WARM] - places[20.0] * (1 + growth)).max() < 1e-7
    done = run("export", "json", robot, "--temperature", WARM, "--out", tmp_path / "a.json")
    assert_refusal(done.err, "E-RUN-110", "json")


def read_csv_names(path: Path) -> list[str]:
    """Header of a table."""
    return path.read_text().splitlines()[0].split(",")


def xyz(path: Path) -> np.ndarray:
    """Columns x, y, z of a table."""
    names = read_csv_names(path)
    first = names.index("x")
    rows = [line.split(",")[first : first + 3] for line in path.read_text().splitlines()[1:]]
    return np.array(rows, dtype=float)
