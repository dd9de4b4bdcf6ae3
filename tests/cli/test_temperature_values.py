"""Temperatures that no arm has are refused wherever they are given, and other units than °C converted where the header says them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from cli_files import read_csv
from dh_arm import DHArm, postures, tracked, write_robot
from refusals import assert_refusal
from thermal_arm import write_warm_poses

from flexcal.cli.main import main

ROWS = 30


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rigid arm calibrated at 24 to 26 °C, its temperature not used."""
    folder, rng = tmp_path_factory.mktemp("values"), np.random.default_rng(8)
    robot, q = write_robot(folder), postures(rng, ROWS)
    points = tracked(DHArm.made(4).points(q), rng, 2e-5)
    write_warm_poses(folder / "poses.csv", q, points, 2e-5, np.linspace(24, 26, ROWS))
    lines = [line.split(",")[:7] for line in (folder / "poses.csv").read_text().splitlines()]
    (folder / "commands.csv").write_text("\n".join(",".join(line) for line in lines) + "\n")
    assert main(["calibrate", str(robot), str(folder / "poses.csv")]) == 0
    return folder


@pytest.mark.parametrize(
    ("given", "code", "words"),
    [
        ("nan", "E-RUN-111", "°C"),
        ("inf", "E-RUN-111", "°C"),
        ("-300", "E-RUN-111", "from -50 to 150"),
        ("305", "E-RUN-111", "kelvin"),
        ("32C", "E-CLI-047", "without a unit"),
    ],
)
def test_options(folder: Path, tmp_path: Path, run: Callable, given: str, code: str, words: str) -> None:
    robot = folder / "robot.yaml"
    for arguments in (
        ("predict", robot, folder / "commands.csv", "--out", tmp_path / "tool.csv"),
        ("map", robot, "--out", tmp_path / "map.html"),
        ("export", "urdf", robot, "--out", tmp_path / "robot.urdf"),
    ):
        assert_refusal(run(*arguments, "--temperature", given).err, code, words)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("celsius", "words"), [(999.0, "correct it"), (298.0, "kelvin")])
def test_columns(folder: Path, tmp_path: Path, run: Callable, celsius: float, words: str) -> None:
    header, rows = read_csv(folder / "poses.csv")
    rows[4, header.index("temperature")] = celsius
    np.savetxt(tmp_path / "p.csv", rows, delimiter=",", header=",".join(header), comments="")
    assert_refusal(
        run("verify", folder / "robot.yaml", tmp_path / "p.csv").err, "E-TABLE-044", "line 6", words
    )


def test_the_reference_temperature(folder: Path, run: Callable) -> None:
    robot = folder / "kelvin.yaml"
    robot.write_text(
        (folder / "robot.yaml").read_text().replace("geometry: {", "geometry: {reference_temperature: 293, ")
    )
    assert "reference_temperature" in robot.read_text()
    assert_refusal(run("calibrate", robot, folder / "poses.csv").err, "E-ROBOT-080", "kelvin")


@pytest.mark.parametrize(
    ("header", "factor", "zero"),
    [
        ("Temp [F]", 1.8, 32.0),
        ("temperature (K)", 1.0, 273.15),
        ("temp_C", 1.0, 0.0),
        ("Temperature [°F]", 1.8, 32.0),
    ],
)
def test_import_converts_by_the_header(
    folder: Path, tmp_path: Path, run: Callable, header: str, factor: float, zero: float
) -> None:
    names, rows = read_csv(folder / "poses.csv")
    column = names.index("temperature")
    celsius = rows[:, column].copy()
    rows[:, column] = factor * celsius + zero
    names[column] = header
    np.savetxt(
        tmp_path / "foreign.csv", rows, delimiter=",", header=",".join(names), comments="", encoding="utf-8"
    )
    out = tmp_path / "poses.csv"
    assert run("import", folder / "robot.yaml", tmp_path / "foreign.csv", "--out", out).status == 0
    names, rows = read_csv(out)
    np.testing.assert_allclose(rows[:, names.index("temperature")], celsius, atol=1e-9)


def test_kelvin_without_a_unit_is_no_celsius(folder: Path, tmp_path: Path, run: Callable) -> None:
    names, rows = read_csv(folder / "poses.csv")
    rows[:, names.index("temperature")] += 273.15
    np.savetxt(tmp_path / "foreign.csv", rows, delimiter=",", header=",".join(names), comments="")
    done = run("import", folder / "robot.yaml", tmp_path / "foreign.csv", "--out", tmp_path / "poses.csv")
    assert_refusal(done.err, "E-TABLE-044", "kelvin", "unit")


def test_a_temperature_without_a_term(folder: Path, tmp_path: Path, run: Callable) -> None:
    """How far it is from the calibration's is said, and the next command has what this one was given."""
    robot, out = folder / "robot.yaml", tmp_path / "tool.csv"
    given = ("--temperature", 32, "--estimates", folder / "estimates.yaml")
    done = run("predict", robot, folder / "commands.csv", "--out", out, *given)
    assert "is not used" in done.out and "from 24.0 to 26.0 °C" in done.out and "6.0 K" in done.out
    assert f"--temperature 32 --estimates {folder / 'estimates.yaml'}" in done.out
    done = run("compensate", robot, folder / "commands.csv", "--out", tmp_path / "c.csv", "--temperature", 32)
    assert "MEASURED.csv --temperature 32" in done.out
