"""`identify response` of an axis whose servo is on: with the excitation's column, without it, and of sines."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from refusals import assert_refusal
from servo_axis import RATE, THREE, TWO, ServoAxis, controlled, excitation, write_log

from flexcal.cli.main import main

PD, P_PI = (67.0, 300.0, 0.0), (15.0, 250.0, 8.0)


def respond(file: Path, folder: Path, *options: str) -> dict:
    assert main(["identify", "response", str(file), *options, "--out", str(folder)]) == 0
    return json.loads((folder / "results.json").read_text())


def quantities(found: dict, axis: ServoAxis) -> list[tuple[str, dict, float]]:
    """Those of resonances, antiresonances and masses, with the truth."""
    result = []
    zeros = found["elements"][0]["antiresonances"]
    for kind, items, held in (("resonance", found["resonances"], False), ("antiresonance", zeros, True)):
        for value in axis.frequencies(held=held):
            near = min(items, key=lambda item: abs(np.log(item["frequency_hz"]["estimate"] / value)))
            result.append((f"{kind} at {value:.3g} Hz", near["frequency_hz"], value))
    parameters = found["masses"]["parameters"]
    result += [(name, parameters[name], value) for name, value in axis.truth.items() if name in parameters]
    return result


def test_the_excitation_column_tells_the_axis_from_the_servo(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    """A third of the torque below 20 Hz is noise that the servo feeds back; above 60 Hz there is nothing else."""
    rng = np.random.default_rng(1)
    added = excitation("noise", 8000, rng)
    torque, angle = controlled(TWO, PD, added, rng, encoder=2e-5, load=3.0)
    found = respond(write_log(tmp_path / "log.csv", torque, angle, added), tmp_path / "out")
    said = " ".join(capsys.readouterr().out.split())
    assert "a controller seems to act on the output; the part of the input that excitation explains" in said
    assert found["excitation"]["high_hz"] < 65 and found["masses"]["count"] == 2
    for name, item, truth in quantities(found, TWO):
        assert abs(item["estimate"] - truth) < 4 * item["std"], name
        assert item["std"] < 0.05 * truth, name
    assert "feedback" not in found["verdict"]["reasons"]


def test_without_the_column_the_bias_is_said(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    rng = np.random.default_rng(2)
    torque, angle = controlled(TWO, PD, excitation("noise", 8000, rng), rng, encoder=2e-5, load=3.0)
    found = respond(write_log(tmp_path / "log.csv", torque, angle), tmp_path / "out")
    said = " ".join(capsys.readouterr().out.split())
    assert "a controller seems to act on the output, and" in said and "--reference COLUMN" in said
    assert "which the intervals do not contain" in said
    assert (
        found["excitation"]["high_hz"] < 65
    )  # beyond, the records show the controller, with a coherence of 1
    assert found["feedback"]["acts"] is True and found["feedback"]["worst_bias"] > 0.1
    assert found["verdict"]["trusted"] is not True and "feedback" in found["verdict"]["reasons"]


def test_in_open_loop_no_controller_is_seen(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    rng = np.random.default_rng(3)
    added = excitation("sweep", 8000, rng)
    torque, angle = controlled(TWO, (0.0, 0.0, 0.0), added, rng, encoder=2e-5, load=1.0)
    found = respond(write_log(tmp_path / "log.csv", torque, angle, added), tmp_path / "out")
    assert "no controller is seen to act" in " ".join(capsys.readouterr().out.split())
    assert found["feedback"]["acts"] is False and found["excitation"]["references"] == []
    assert found["excitation"]["high_hz"] < 60


def test_a_commanded_position_that_excites_nothing_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    """The log has the path of the axis, but not the noise that was put on the torque."""
    rng = np.random.default_rng(5)
    torque, angle = controlled(TWO, PD, excitation("noise", 8000, rng), rng, encoder=2e-6, load=0.3)
    file = write_log(tmp_path / "log.csv", torque, angle, np.sin(2 * np.pi * np.arange(8000) / RATE))
    file.write_text(file.read_text().replace("excitation", "position setpoint"))
    found = respond(file, tmp_path / "out")
    said = " ".join(capsys.readouterr().out.split())
    assert "position setpoint is called like a reference, but explains the input in a small part" in said
    assert found["excitation"]["references"] == [] and found["masses"]["count"] == 2


@pytest.mark.parametrize(
    ("sines", "gains", "refusal"),
    [
        ((7.03,), (0.0, 0.0, 0.0), ["E-RUN-076", "7.03"]),
        ((7.03,), PD, ["E-RUN-077", "7.03"]),
        ((7.0, 11.0), (0.0, 0.0, 0.0), ["E-RUN-076", "2 sines, of 7, 11 Hz"]),
    ],
)
def test_sines_are_named(
    tmp_path: Path,
    capsys: pytest.CaptureFixture,
    sines: tuple[float, ...],
    gains: tuple[float, float, float],
    refusal: list[str],
) -> None:
    t = np.arange(8000) / RATE
    added = 20 * np.sum([np.sin(2 * np.pi * f * t) for f in sines], axis=0)
    torque, angle = controlled(TWO, gains, added, np.random.default_rng(4), encoder=2e-6, load=0.0)
    file = write_log(tmp_path / "log.csv", torque, angle)
    assert main(["identify", "response", str(file), "--out", str(tmp_path / "out")]) == 2
    assert_refusal(capsys.readouterr().err, *refusal)
    assert not (tmp_path / "out").exists()


def quantities_inside(
    seed: int,
    folder: Path,
    axis: ServoAxis,
    gains: tuple[float, float, float],
    kind: str,
    encoder: float,
    load: float,
) -> list[bool]:
    """Whether what one log tells lies in its intervals."""
    rng = np.random.default_rng(seed)
    added = excitation(kind, 8000, rng)
    torque, angle = controlled(axis, gains, added, rng, encoder=encoder, load=load)
    found = respond(write_log(folder / f"{seed}.csv", torque, angle, added), folder / str(seed))
    return [item["low"] <= truth <= item["high"] for _, item, truth in quantities(found, axis)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axis", "gains", "kind", "encoder", "load"),
    [
        (TWO, PD, "noise", 2e-5, 3.0),
        (TWO, P_PI, "multisine", 2e-5, 3.0),
        (THREE, P_PI, "sweep", 1e-5, 1.0),
    ],
)
def test_intervals_cover_in_closed_loop(
    tmp_path: Path,
    axis: ServoAxis,
    gains: tuple[float, float, float],
    kind: str,
    encoder: float,
    load: float,
) -> None:
    found = over_seeds(quantities_inside, range(500, 520), tmp_path, axis, gains, kind, encoder, load)
    inside = np.concatenate(found)
    assert np.mean(inside) >= 0.9
    assert len(inside) > 0.9 * 20 * (2 * len(axis.inertia) - 2 + len(axis.truth))
