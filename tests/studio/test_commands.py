"""Command lines in processes of their own: progress, end, failure, cancelling."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from waiting import PATIENCE, until

from flexcal import RobotModel, calibrate, read_poses
from flexcal.studio.commands import CommandRun, CommandRunner

EXAMPLE = Path(__file__).parents[2] / "examples" / "ur5_tracker"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("cell")
    for name in ("robot.yaml", "ur5.urdf"):
        shutil.copy(EXAMPLE / name, place)
    lines = (EXAMPLE / "grid.csv").read_text().splitlines()
    (place / "poses.csv").write_text("\n".join([lines[0], *lines[1::10]]) + "\n")
    return place


def ended(run: CommandRun) -> CommandRun:
    run.wait(PATIENCE)
    assert run.status != "running"
    return run


def test_a_calibration_gives_the_numbers_of_the_library(folder: Path) -> None:
    run = ended(CommandRun(["calibrate", "robot.yaml", "poses.csv", "--out", "calibration"], folder))
    assert run.status == "done", run.messages
    assert run.line == "flexcal calibrate robot.yaml poses.csv --out calibration"
    assert run.stages["rigid fit"] == 1.0
    stage = run.stage
    assert stage is not None
    assert stage[0] == "selected fit"
    model = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    expected = calibrate(model, read_poses(folder / "poses.csv", model))
    told = run.document["calibration"]["selected"]["p90_mm"]
    np.testing.assert_allclose(told, expected.errors.p90 * 1e3, rtol=1e-6)
    assert any("Trusted" in message for message in run.messages)
    assert not any(message.startswith("{") for message in run.messages)


def test_a_failure_is_its_sentence_and_writes_nothing(folder: Path) -> None:
    run = ended(CommandRun(["calibrate", "robot.yaml", "nowhere.csv", "--out", "other"], folder))
    assert run.status == "failed"
    assert "nowhere.csv" in run.error
    assert "flexcal:" not in run.error
    assert not (folder / "other").exists()


def test_cancelling_leaves_no_file(folder: Path) -> None:
    run = CommandRun(["demo", "--seed", "1", "--out", "long"], folder)
    until(lambda: run.stage is not None)
    run.cancel()
    assert ended(run).status == "cancelled"
    assert not list((folder / "long").glob("*.html"))


def test_one_command_at_a_time_and_its_end_is_told_once(folder: Path) -> None:
    runner, told = CommandRunner(folder), []
    run = runner.start(["calibrate", "robot.yaml", "nowhere.csv"], told.append)
    with refused("E-STUDIO-042"):
        runner.start(["init", "ur5.urdf"], told.append)
    ended(run)
    runner.settle()
    runner.settle()
    assert told == [run]
    assert not runner.is_busy


def test_progress_as_json_lines(folder: Path) -> None:
    """What any program may ask for: one object a line, shares that rise from 0 to 1."""
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "flexcal.cli.main",
            "calibrate",
            "robot.yaml",
            "poses.csv",
            "--json",
            "--out",
            "again",
        ],
        cwd=folder,
        env={"FLEXCAL_PROGRESS": "json", "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=True,
    )
    told = [json.loads(line) for line in done.stderr.splitlines() if line.startswith('{"stage"')]
    assert {item["stage"] for item in told} >= {"reading", "rigid fit", "selected fit"}
    for stage in {item["stage"] for item in told}:
        shares = [item["share"] for item in told if item["stage"] == stage]
        assert shares == sorted(shares)
        assert shares[-1] == 1.0
    assert "calibration" in json.loads(done.stdout)
