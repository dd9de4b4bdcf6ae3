"""`flexcal identify actuators`: an arm that another program simulates, by its positions and commands alone."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from refusals import assert_refusal
from servo_arm import NAMES, TRUTH, arm, command, simulate, write_log

from flexcal.cli.main import main

RATE, NOISE, SECONDS = 100.0, 2e-4, 16.0


@pytest.fixture(scope="module")
def moves(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """robot.yaml and moves.csv."""
    folder = tmp_path_factory.mktemp("servo")
    arm(folder)
    rng = np.random.default_rng(5)
    commands = command(SECONDS, RATE, rng)
    q = simulate(TRUTH, commands[None], RATE, step=5e-4)[0]
    write_log(folder / "moves.csv", 1 / RATE, commands, q + NOISE * rng.standard_normal(q.shape))
    return folder


def test_actuators_are_those_of_the_arm(moves: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    robot, log, out = (str(path) for path in (moves / "robot.yaml", moves / "moves.csv", tmp_path / "out"))
    assert main(["identify", "actuators", robot, log, "--out", out, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    for i, joint in enumerate(NAMES):
        for key, true in TRUTH.values().items():
            if key == "viscous":
                continue
            item = found["parameters"][f"{joint}.actuator.{key}"]
            whole = true[i] + (TRUTH.viscous[i] if key == "damping" else 0.0)
            assert abs(item["estimate"] - whole) < max(4 * item["std"], 0.01 * whole), (joint, key)
            assert item["std"] < 0.1 * whole
    for item in found["errors"].values():
        assert item["held_out"]["simulated"] < 1.3 * NOISE < 0.01 * item["held_out"]["commanded"]
    assert found["verdict"]["trusted"] is True
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "moves like the real one" in page
    assert "actuators:" in (tmp_path / "out" / "estimates.yaml").read_text(encoding="utf-8")


def test_refusals(moves: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    robot, log = str(moves / "robot.yaml"), moves / "moves.csv"
    table = pl.read_csv(log)

    def refused(name: str, changed: pl.DataFrame, code: str, *words: str) -> None:
        changed.write_csv(tmp_path / name)
        assert (
            main(["identify", "actuators", robot, str(tmp_path / name), "--out", str(tmp_path / "no")]) == 2
        )
        assert_refusal(capsys.readouterr().err, code, *words)
        assert not (tmp_path / "no").exists()

    refused("uncommanded.csv", table.drop("qc1", "qc2"), "E-TABLE-006", "qc1")
    refused("short.csv", table[:300], "E-DYN-045")
    refused("still.csv", table.with_columns(q2=pl.lit(0.2)), "E-DYN-046", "elbow")
    refused("gap.csv", pl.concat([table[:500], table[700:]]), "E-LOG-023")
    assert main(["identify", "actuators", robot, str(log), "--known-gains"]) == 2
    assert_refusal(capsys.readouterr().err, "E-RUN-106", "controller")
    assert main(["identify", "actuators", robot, str(log), "--hold-out", "1"]) == 2
    assert_refusal(capsys.readouterr().err, "E-CLI-043", "--hold-out")
