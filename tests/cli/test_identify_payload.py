"""`flexcal identify payload`: what the robot holds, what uses it afterwards, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest
from refusals import assert_refusal, refused
from two_links import GAINS, HELD, swings, two_links

from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.files.formats import read_estimates
from flexcal.model.robot import RobotModel
from flexcal.model.statics import gravity_torque

if TYPE_CHECKING:
    from conftest import Run

ROBOT = "dynamics: {cutoff_hz: 20, decimation: 1, friction: classic}\n"
DECLARED = "payload: {frame: lower, mass: 3.0, com: [0.3, 0.07, 0], mass_std: 0.05}\n"


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """robot.yaml, free.csv, other.csv (free too) and loaded.csv, with noise."""
    observation = Observation(two_links(tmp_path, ROBOT), CLASSIC)
    rng = np.random.default_rng(1)
    for name, held, seed in (("free", 0 * HELD, 7), ("other", 0 * HELD, 8), ("loaded", HELD, 9)):
        motion = swings(observation, held, seed)
        motion = replace(motion, torque=motion.torque * GAINS + 0.1 * rng.normal(size=motion.torque.shape))
        columns = {"t": motion.time} | {f"q{i + 1}": motion.q[:, i] for i in range(2)}
        columns |= {f"tau{i + 1}": motion.torque[:, i] for i in range(2)}
        pl.DataFrame(columns).write_csv(tmp_path / f"{name}.csv")
    return tmp_path


def declare(arm: Path, line: str = DECLARED) -> None:
    robot = arm / "robot.yaml"
    robot.write_text(robot.read_text() + line)


def with_column(log: Path, mass: float) -> None:
    pl.read_csv(log).with_columns(payload=pl.lit(mass)).write_csv(log)


def test_it_comes_with_the_robot_from_then_on(arm: Path, run: Run) -> None:
    """robot.yaml declares no payload; the accelerations of a log at 50 Hz are what limits it to a hundredth."""
    robot = arm / "robot.yaml"
    outcome = run("identify", "payload", robot, arm / "loaded.csv", "--free", arm / "free.csv", "--json")
    assert outcome.status == 0, outcome.err
    document = outcome.document
    assert document["frame"] == "lower"
    mass = document["parameters"]["payload.mass"]
    assert mass["estimate"] == pytest.approx(HELD[0], rel=0.01)
    assert mass["low"] < mass["estimate"] < mass["high"] and mass["identifiable"]
    assert document["parameters"]["payload.Iyy"] == {
        "estimate": 0.0, "std": None, "low": None, "high": None, "bound": None, "truth": None, "identifiable": False,
    }  # fmt: skip
    assert any("do not determine payload.com_y" in remark for remark in document["remarks"])
    model = RobotModel.from_yaml(robot)
    held = model.payload
    assert held is not None and held.frame == "lower" and held.mass == mass["estimate"]
    assert model.posterior.determines("payload.com_x") and not model.posterior.determines("payload.com_y")
    still = np.array([[0.4, -0.3]])
    weight = gravity_torque(model, still) - gravity_torque(model, still, 0.0)
    arms = 0.4 * np.cos(0.4) + held.com[0] * np.cos(0.1) + held.com[2] * np.sin(0.1)
    assert abs(weight[0, 0]) == pytest.approx(9.81 * held.mass * arms, rel=1e-6)
    assert (
        run("identify", "payload", robot, arm / "loaded.csv", "--free", arm / "free.csv", "--json").document[
            "parameters"
        ]
        == document["parameters"]
    )


def test_the_printed_line_says_the_same(arm: Path, run: Run) -> None:
    robot = arm / "robot.yaml"
    out = arm / "out"
    outcome = run("identify", "payload", robot, arm / "loaded.csv", "--free", arm / "free.csv", "--out", out)
    line = next(text for text in outcome.out.splitlines() if "as a line of robot.yaml" in text)
    declare(arm, line.partition(": ")[2] + "\n")
    held = RobotModel.from_yaml(robot).payload
    stored = json.loads((out / "results.json").read_text())["parameters"]
    assert held is not None and held.mass == pytest.approx(stored["payload.mass"]["estimate"], rel=1e-4)
    assert not (arm / "estimates.yaml").exists()
    assert set(read_estimates(out / "estimates.yaml")) == {"payload"}


def test_a_recording_that_the_dynamics_were_made_from_tells_no_payload(arm: Path, run: Run) -> None:
    robot, loaded = arm / "robot.yaml", arm / "loaded.csv"
    assert run("identify", "dynamics", robot, loaded).status == 0
    done = run("identify", "payload", robot, loaded)
    assert done.status == 2
    assert_refusal(done.err, "E-RUN-067")


def test_from_identified_dynamics(arm: Path, run: Run) -> None:
    """The block in place of recordings without payload; those that it was made from would be used twice, others help."""
    robot, loaded = arm / "robot.yaml", arm / "loaded.csv"
    declare(arm)
    for name in ("free", "other"):
        with_column(arm / f"{name}.csv", 0.0)
    assert run("identify", "dynamics", robot, arm / "free.csv").status == 0
    alone = run("identify", "payload", robot, loaded, "--json").document
    assert alone["parameters"]["payload.mass"]["estimate"] == pytest.approx(HELD[0], rel=0.01)
    assert any("robot.yaml declares 3 kg" in remark for remark in alone["remarks"])
    both = run("identify", "payload", robot, loaded, "--free", arm / "other.csv", "--json").document
    assert both["parameters"]["payload.mass"]["std"] < alone["parameters"]["payload.mass"]["std"]
    twice = run("identify", "payload", robot, loaded, "--free", arm / "free.csv")
    assert twice.status == 2
    assert_refusal(twice.err, "E-RUN-067")
    assert set(read_estimates(arm / "estimates.yaml")) == {"dynamics", "payload"}
    held = RobotModel.from_yaml(robot).payload
    assert held is not None and held.com[1] == 0.07


def test_a_frame_that_changed_is_seen(arm: Path, run: Run) -> None:
    robot = arm / "robot.yaml"
    assert run("identify", "payload", robot, arm / "loaded.csv", "--free", arm / "free.csv").status == 0
    declare(arm, DECLARED.replace("lower", "upper"))
    with refused("E-ROBOT-048", "lower", "upper"):
        RobotModel.from_yaml(robot)


def still(table: pl.DataFrame) -> pl.DataFrame:
    return table.with_columns(q1=pl.lit(0.3), q2=pl.lit(0.1))


@pytest.mark.parametrize(
    ("options", "change", "refusal"),
    [
        ([], None, ["E-RUN-064"]),
        (["--free", "loaded.csv"], None, ["E-RUN-044", "loaded.csv", "is given twice"]),
        (["--free", "free.csv", "--frame", "hand"], None, ["E-ROBOT-003", "hand", "shoulder, upper"]),
        (["--free", "free.csv", "--frame", "base"], None, ["E-ROBOT-003", "base"]),
        (["--free", "none.csv"], None, ["E-FILE-001", "none.csv"]),
        (["--free", "free.csv"], still, ["E-DYN-025"]),
        (["--free", "free.csv"], lambda t: t.drop("q2", "tau2"), ["E-TABLE-007", "q2"]),
        (["--free", "free.csv"], lambda t: t.drop("tau1", "tau2"), ["E-TABLE-006", "tau1"]),
        (["--free", "free.csv"], lambda t: t.with_columns(q3=pl.lit(0.0)), ["E-TABLE-007", "q3"]),
        (["--free", "free.csv"], lambda t: t.with_columns(tau1=-pl.col("tau1"), tau2=-pl.col("tau2")), ["E-RUN-061", "change its sign"]),
        (["--free", "free.csv"], lambda t: t.head(40), ["E-LOG-021", "loaded.csv"]),
    ],
)  # fmt: skip
def test_what_is_refused(arm: Path, run: Run, options: list[str], change: object, refusal: list[str]) -> None:
    if callable(change):
        changed = change(pl.read_csv(arm / "loaded.csv"))
        assert isinstance(changed, pl.DataFrame)
        changed.write_csv(arm / "loaded.csv")
    named = [arm / word if word.endswith(".csv") else word for word in options]
    outcome = run("identify", "payload", arm / "robot.yaml", arm / "loaded.csv", *named)
    assert outcome.status == 2
    assert_refusal(outcome.err, *refusal)
    assert not (arm / "estimates.yaml").exists()


def test_columns_of_payload_are_believed(arm: Path, run: Run) -> None:
    for name, mass, refusal in (
        ("loaded", 0.0, ["E-RUN-070", "loaded.csv"]),
        ("free", 4.0, ["E-RUN-071", "free.csv", "4"]),
    ):
        with_column(arm / f"{name}.csv", mass)
        outcome = run(
            "identify", "payload", arm / "robot.yaml", arm / "loaded.csv", "--free", arm / "free.csv"
        )
        assert outcome.status == 2
        assert_refusal(outcome.err, *refusal)
        with_column(arm / "loaded.csv", 4.0)


def test_a_frame_beside_a_declared_one(arm: Path, run: Run) -> None:
    declare(arm)
    outcome = run(
        "identify", "payload", arm / "robot.yaml", arm / "loaded.csv", "--free", arm / "free.csv", "--frame", "upper"
    )  # fmt: skip
    assert outcome.status == 2
    assert_refusal(outcome.err, "E-RUN-066", "lower")


def test_nothing_in_the_hand(arm: Path, run: Run) -> None:
    outcome = run("identify", "payload", arm / "robot.yaml", arm / "other.csv", "--free", arm / "free.csv")
    assert outcome.status == 2
    assert_refusal(outcome.err, "E-DYN-022")


def test_a_mass_that_no_body_has_is_called_impossible(arm: Path, run: Run) -> None:
    """Loaded and free exchanged: the robot's own dynamics hold the payload."""
    outcome = run("identify", "payload", arm / "robot.yaml", arm / "free.csv", "--free", arm / "loaded.csv")
    assert outcome.status == 2
    assert_refusal(outcome.err, "E-DYN-021", "-4")
    assert_refusal(outcome.err, "E-DYN-021")


def test_estimates_of_another_folder(arm: Path, run: Run) -> None:
    """The folder of `identify dynamics --out` serves as it is, and takes the payload; nothing appears beside robot.yaml."""
    robot, loaded, own = arm / "robot.yaml", arm / "loaded.csv", arm / "own"
    said = run("identify", "dynamics", robot, arm / "free.csv", "--out", own).err
    assert run("identify", "payload", robot, loaded).status == 2
    outcome = run("identify", "payload", robot, loaded, "--estimates", own, "--json")
    assert outcome.status == 0, outcome.err + said
    assert outcome.document["parameters"]["payload.mass"]["estimate"] == pytest.approx(HELD[0], rel=0.01)
    assert set(read_estimates(own / "estimates.yaml")) == {"dynamics", "payload"}
    assert not (arm / "estimates.yaml").exists()
    nowhere = run("identify", "payload", robot, loaded, "--estimates", arm / "nowhere.yaml")
    assert nowhere.status == 2
    assert_refusal(nowhere.err, "E-RUN-063", "nowhere.yaml")
