"""`flexcal identify gains`: currents to torques by a payload of known mass, and what it refuses."""

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from refusals import assert_refusal
from two_links import GAINS, HELD, PAYLOAD, swings, two_links

from flexcal.cli.main import main
from flexcal.dynamics.inverse_model import CLASSIC, Observation
from flexcal.report.layout import significant

DECLARED = np.array([50.0, 20.0])
ROBOT = (
    "dynamics: {cutoff_hz: 20, decimation: 1, friction: classic}\n"
    "signals: {tau: {columns: [i1, i2], unit: A, gain: [50, 20]}}\n"
)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """robot.yaml, free.csv and loaded.csv, with currents."""
    observation = Observation(two_links(tmp_path, ROBOT + PAYLOAD), CLASSIC)
    for name, held in (("free", 0 * HELD), ("loaded", HELD)):
        motion = swings(observation, held, 7)
        columns = {"t": motion.time} | {f"q{i + 1}": motion.q[:, i] for i in range(2)}
        columns |= {f"i{i + 1}": motion.torque[:, i] / DECLARED[i] for i in range(2)}
        columns["payload"] = np.full(len(motion), held[0])
        pl.DataFrame(columns).write_csv(tmp_path / f"{name}.csv")
    return tmp_path


def arguments(arm: Path, *logs: str) -> list[str]:
    return [str(arm / "robot.yaml"), *(str(arm / f"{log}.csv") for log in logs)]


def refused_verb(verb: str, given: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["identify", verb, *given]) == 2
    return capsys.readouterr().err


def test_gains_come_back_and_can_be_pasted(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Up to what a sample rate of 50 Hz makes of accelerations; the printed line gives factors of one."""
    given = arguments(arm, "free", "loaded")
    assert main(["identify", "gains", *given, "--out", str(arm / "out")]) == 0
    line = next(text for text in capsys.readouterr().out.splitlines() if text.startswith("signals: "))
    found = json.loads((arm / "out" / "results.json").read_text())
    assert found["declared_gains"] == list(DECLARED)
    assert found["payloads_kg"] == [0.0, HELD[0]]
    assert found["gains"] == pytest.approx(list(DECLARED * GAINS), rel=0.01)
    factor = found["parameters"]["elbow.drive_gain"]
    assert factor["low"] < factor["estimate"] < factor["high"] and factor["identifiable"]
    page = (arm / "out" / "report.html").read_text("utf-8")
    assert significant(found["gains"][0], 5) in page
    assert f"{significant(factor['low'])} to {significant(factor['high'])}" in page
    assert found["provenance"]["input.loaded.csv"] in page and "All 2." in page
    assert found["verdict"] == {"trusted": True, "reasons": ["half_gains"]}
    assert set(found["halves"]["factors"]) == {"shoulder.drive_gain", "elbow.drive_gain"}
    assert main(["report", str(arm / "out")]) == 0
    assert (arm / "out" / "report.html").read_text("utf-8") == page
    capsys.readouterr()
    robot = (arm / "robot.yaml").read_text()
    gain = line[line.index("gain: [") : line.index("]") + 1]
    (arm / "robot.yaml").write_text(robot.replace("gain: [50, 20]", gain))
    assert main(["identify", "gains", *given, "--json"]) == 0
    again = json.loads(capsys.readouterr().out)["parameters"]
    assert [again[f"{joint}.drive_gain"]["estimate"] for joint in ("shoulder", "elbow")] == pytest.approx(
        [1, 1], rel=1e-4
    )


def test_a_gain_that_changes_while_recording_is_not_trusted(
    arm: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Currents of the shoulder that are a fifth larger in the second half, as of a motor that warms up."""
    for name in ("free", "loaded"):
        table = pl.read_csv(arm / f"{name}.csv")
        later = pl.col("t") > table["t"].to_numpy().max() / 2
        table.with_columns(i1=pl.col("i1") * pl.when(later).then(1.2).otherwise(1.0)).write_csv(
            arm / f"{name}.csv"
        )
    assert main(["identify", "gains", *arguments(arm, "free", "loaded"), "--json"]) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert found["verdict"]["trusted"] is None and "half_gains" in found["verdict"]["reasons"]
    assert "the first and the second half of the recordings give different gains" in printed.err
    shoulder = found["halves"]["factors"]["shoulder.drive_gain"]
    assert shoulder["second"] / shoulder["first"] == pytest.approx(1 / 1.2, rel=0.02)


def test_currents_of_any_scale(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """At gains of 1 they look like torques of motors, which the robot's own dynamics refuse; here the gains are what is sought."""
    robot = arm / "robot.yaml"
    robot.write_text(robot.read_text().replace("gain: [50, 20]", "gain: [1, 1]"))
    assert_refusal(
        refused_verb("dynamics", arguments(arm, "free"), capsys), "E-RUN-061", "torques on the motor side"
    )
    assert main(["identify", "gains", *arguments(arm, "free", "loaded"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["gains"] == pytest.approx(list(DECLARED * GAINS), rel=0.01)


def test_a_link_to_itself_is_no_log(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (arm / "loop.csv").symlink_to("loop.csv")
    assert_refusal(refused_verb("gains", arguments(arm, "free", "loop"), capsys), "E-FILE-001", "loop.csv")


def test_the_robots_own_dynamics_take_the_free_logs(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "dynamics", *arguments(arm, "free"), "--out", str(arm / "out")]) == 0
    message = refused_verb("dynamics", arguments(arm, "free", "loaded"), capsys)
    assert_refusal(message, "E-RUN-058", "loaded.csv", "4")


@pytest.mark.parametrize(
    ("payload", "refusal"),
    [
        (None, ["E-RUN-057"]),
        (pl.lit(-1.0), ["E-LOG-015", "column payload: a payload of -1 kg; it must not be negative"]),
        (
            pl.when(pl.col("t") < 1.0).then(0.0).otherwise(4.0),
            ["E-LOG-015", "a log has one payload, so cut it there into two files"],
        ),
        (pl.lit(0.0), ["E-DYN-001"]),
    ],
)
def test_payloads_that_do_not_work(
    payload: pl.Expr | None, refusal: list[str], arm: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = arm / "loaded.csv"
    table = pl.read_csv(log).drop("payload")
    (table if payload is None else table.with_columns(payload.alias("payload"))).write_csv(log)
    assert_refusal(
        refused_verb("gains", [*arguments(arm, "free", "loaded"), "--out", str(arm / "out")], capsys),
        *refusal,
    )
    assert not (arm / "out" / "results.json").exists()


def test_a_payload_column_without_a_payload(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = arm / "robot.yaml"
    robot.write_text(robot.read_text().replace(PAYLOAD, ""))
    assert_refusal(refused_verb("gains", arguments(arm, "free"), capsys), "E-LOG-014")


def test_columns_that_are_no_joints(arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With a matrix that mixes them no column has the gain of a joint."""
    robot = arm / "robot.yaml"
    (arm / "mixed.csv").write_text("1,0\n1,1\n")
    robot.write_text(robot.read_text().replace("gain: [50, 20]", "gain: [50, 20], matrix: mixed.csv"))
    assert_refusal(refused_verb("gains", arguments(arm, "free", "loaded"), capsys), "E-RUN-032")
    (arm / "mixed.csv").write_text("2,0\n0,1\n")
    assert main(["identify", "gains", *arguments(arm, "free", "loaded"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["gains"] == pytest.approx(list(DECLARED * GAINS * [0.5, 1]), rel=0.01)
