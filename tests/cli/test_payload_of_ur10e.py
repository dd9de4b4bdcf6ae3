"""The payload of a UR10e from its currents, against what was screwed on: as right as the drive gains are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl
import pytest
from ur10e_logs import FOLDER, at_hand, log, published_gains

if TYPE_CHECKING:
    from conftest import Run

PAYLOAD = 2.805
NAMES = ("ur-20_02_19_14harm50sec.csv", "ur-20_02_19_14harm50secLoad.csv")

pytestmark = at_hand


def written(folder: Path, gains: str, payload: str = "") -> Path:
    """robot.yaml, free.csv and loaded.csv."""
    (folder / "robot.yaml").write_text(
        f"robot: {FOLDER.absolute() / 'ur10e.urdf'}\ndynamics: {{cutoff_hz: 5, decimation: 10, friction: classic}}\n"
        f"signals: {{tau: {{columns: [i1, i2, i3, i4, i5, i6], unit: A, gain: [{gains}]}}}}\n{payload}"
    )
    for name, source, mass in zip(("free", "loaded"), NAMES, (0.0, PAYLOAD), strict=True):
        table = log(source, slice(300, -300))
        (table.with_columns(payload=pl.lit(mass)) if payload else table).write_csv(folder / f"{name}.csv")
    return folder / "robot.yaml"


def mass(robot: Path, run: Run) -> dict[str, float]:
    logs = [robot.parent / name for name in ("loaded.csv", "free.csv")]
    outcome = run("identify", "payload", robot, logs[0], "--free", logs[1], "--frame", "tool0", "--json")
    assert outcome.status == 0, outcome.err
    return outcome.document["parameters"]["payload.mass"]


def test_published_gains_are_too_small_and_so_is_the_mass(tmp_path: Path, run: Run) -> None:
    """By 2 to 18 % against those of `identify gains`."""
    robot = written(tmp_path, ", ".join(str(gain) for gain in published_gains()))
    found = mass(robot, run)
    assert 0.82 < found["estimate"] / PAYLOAD < 0.98
    assert found["high"] < PAYLOAD


def test_with_identified_gains_it_is_what_was_weighed(tmp_path: Path, run: Run) -> None:
    """Which closes a circle, for the gains come from the same recordings and that mass; other equations and another estimator do."""
    (tmp_path / "gains").mkdir()
    held = f"payload: {{frame: tool0, mass: {PAYLOAD}, com: [0, 0, 0.05]}}\n"
    robot = written(tmp_path / "gains", "1, 1, 1, 1, 1, 1", held)
    logs = [robot.parent / name for name in ("free.csv", "loaded.csv")]
    gains = run("identify", "gains", robot, *logs, "--json").document["gains"]
    found = mass(written(tmp_path, ", ".join(str(gain) for gain in gains)), run)
    assert found["low"] < PAYLOAD < found["high"]
    assert found["estimate"] == pytest.approx(PAYLOAD, rel=0.03)
