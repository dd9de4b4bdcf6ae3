"""The command line that the help shows for every verb, run as it stands where what it reads is there."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from cli_files import read_csv, write_csv
from newcomer_robot import urdf_text
from two_links import HELD, PAYLOAD, swings, two_links

from flexcal.cli.main import main
from flexcal.cli.verbs import VERBS
from flexcal.dynamics import CLASSIC, Observation


def run(line: str) -> None:
    """A command line of the help, in the current folder."""
    assert main(shlex.split(line)[1:]) == 0, line


def example(name: str) -> str:
    return next(verb.example for verb in VERBS if verb.name == name)


def own_robot(folder: Path, examples: Path) -> list[str]:
    (folder / "robot.urdf").write_text(urdf_text())
    return ["init"]


def foreign_file(folder: Path, examples: Path) -> list[str]:
    shutil.copytree(examples / "ur5_tracker", folder, dirs_exist_ok=True)
    header, rows = read_csv(folder / "grid.csv")
    write_csv(folder / "measured.csv", [name.upper() for name in header], rows[::20])
    return ["import", "completion"]


def recordings_of_two_payloads(folder: Path, examples: Path) -> list[str]:
    signals = "signals: {tau: {columns: [i1, i2], unit: A, gain: [50, 20]}}\n"
    robot = two_links(
        folder, f"dynamics: {{cutoff_hz: 20, decimation: 1, friction: classic}}\n{signals}{PAYLOAD}"
    )
    observation = Observation(robot, CLASSIC)
    (folder / "logs").mkdir()
    for name, held in (("free", 0 * HELD), ("loaded", HELD)):
        motion = swings(observation, held, 7)
        columns = {"t": motion.time, "payload": np.full(len(motion), held[0])}
        for i, gain in enumerate((50, 20)):
            columns |= {f"q{i + 1}": motion.q[:, i], f"i{i + 1}": motion.torque[:, i] / gain}
        pl.DataFrame(columns).write_csv(folder / "logs" / f"{name}.csv")
    return ["identify gains"]


def exciting_motion(folder: Path, examples: Path) -> list[str]:
    shutil.copytree(
        examples / "tx40", folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("estimates.*")
    )
    return ["identify dynamics"]


def virtual_robot(folder: Path, examples: Path) -> list[str]:
    """The procedure on the TX90L, with what people do between its verbs."""
    shutil.copytree(
        examples / "tx90l", folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("estimates.*")
    )
    run(example("design trajectory"))
    run("flexcal measure trajectory.yaml --cell virtual --out exciting")
    run(example("identify inertials"))
    for name in ("design frequency", "measure", "identify response", "identify stiffness", "design poses"):
        run(example(name))
    run("flexcal measure poses.yaml --cell virtual --out measured")
    shutil.copy("measured/poses.csv", "poses.csv")
    run("flexcal design poses robot.yaml --random --count 30 --out others.yaml")
    run("flexcal measure others.yaml --cell virtual --out unseen")
    shutil.copy("unseen/poses.csv", "others.csv")
    run(example("calibrate"))
    run("flexcal calibrate robot.yaml poses.csv --out results")
    Path("targets.csv").write_text("pose,q1,q2,q3,q4,q5,q6\n1,0.1,0.4,0.9,0.2,0.5,0.3\n")
    return ["verify", "compensate", "predict", "report", "export urdf"]


DONE_ON_THE_WAY = {
    "design trajectory",
    "identify inertials",
    "design frequency",
    "measure",
    "identify response",
}
DONE_ON_THE_WAY |= {"identify stiffness", "design poses", "calibrate"}
PLACES = {
    own_robot: {"init"},
    foreign_file: {"import", "completion"},
    recordings_of_two_payloads: {"identify gains"},
    exciting_motion: {"identify dynamics"},
    virtual_robot: DONE_ON_THE_WAY | {"verify", "compensate", "predict", "report", "export urdf"},
}


def test_every_verb_has_a_place() -> None:
    """`demo` is run by tests/test_readme.py."""
    named = [name for names in PLACES.values() for name in names]
    assert sorted([*named, "demo"]) == sorted(verb.name for verb in VERBS)


@pytest.mark.parametrize("place", [own_robot, foreign_file], ids=lambda place: place.__name__)
def test_quick_examples_run(place, tmp_path: Path, examples: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here(place, tmp_path, examples, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize(
    "place", [recordings_of_two_payloads, exciting_motion, virtual_robot], ids=lambda place: place.__name__
)
def test_slow_examples_run(place, tmp_path: Path, examples: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here(place, tmp_path, examples, monkeypatch)


def here(place, tmp_path: Path, examples: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the examples of a place in a folder made for them."""
    monkeypatch.chdir(tmp_path)
    left = place(tmp_path, examples)
    for name in left:
        run(example(name))
    assert set(left) == PLACES[place] - DONE_ON_THE_WAY
