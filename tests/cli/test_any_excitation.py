"""`identify response` of files without a plan, made by a simulator of its own."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from axis_simulator import STEP, Axis, chirp, multisine
from refusals import assert_refusal

from flexcal.cli.main import main

LINK = Path(os.environ.get("FLEXCAL_DATASETS", "")) / "flexible_link"


def write(path: Path, columns: dict[str, np.ndarray], separator: str = ",") -> Path:
    rows = [separator.join(columns)]
    rows += [separator.join(f"{value:.10g}" for value in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def run(arguments: list[object]) -> int:
    return main(["identify", "response", *map(str, arguments)])


def results(folder: Path) -> dict:
    return json.loads((folder / "results.json").read_text())


def inside(item: dict, truth: float) -> bool:
    return item["low"] <= truth <= item["high"]


def test_a_three_mass_axis_from_a_swept_sine_in_degrees(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    axis, generator = Axis(), np.random.default_rng(1)
    torque, q = axis.run(chirp(8000, 2.0, 50.0, 20.0))
    seen = np.degrees(q[:, 0]) + 1e-4 * generator.normal(size=8000)
    file = write(
        tmp_path / "sweep.csv",
        {"time [ms]": 1e3 * STEP * np.arange(8000), "Drehmoment (Nm)": torque, "axis1_pos [deg]": seen},
    )
    assert run([file, "--out", tmp_path / "out"]) == 0
    found = results(tmp_path / "out")
    for name, truth in (("resonances", axis.resonances), ("antiresonances", axis.antiresonances)):
        items = found[name] if name in found else found["elements"][0][name]
        assert len(items) == 2
        for item, frequency, damping in zip(items, *truth, strict=True):
            assert item["frequency_hz"]["estimate"] == pytest.approx(frequency, rel=0.002)  # 1 % asked for
            assert item["damping"]["estimate"] == pytest.approx(damping, rel=0.05)
    masses = found["masses"]
    assert masses["count"] == 3
    truth = dict(zip(masses["parameters"], (2, 1, 3, 20e3, 9e3, 8, 6, 5), strict=True))
    assert all(
        item["estimate"] == pytest.approx(truth[name], rel=0.02)
        for name, item in masses["parameters"].items()
    )
    assert {item["unit"] for item in masses["parameters"].values()} == {"kg m²", "N m/rad", "N m s/rad"}
    said = capsys.readouterr().out
    assert "there is one record only" in said and "next:" in said
    assert "[deg]" in said and "\\[" not in said  # names are printed as they are
    assert (tmp_path / "out" / "report.html").is_file()
    header, first = (tmp_path / "out" / "response.csv").read_text().splitlines()[:2]
    assert header.split(",")[0] == "frequency_hz" and float(first.split(",")[0]) > 0.1


def test_an_unknown_period_is_found_and_two_files_are_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    axis, generator = Axis(inertias=(2.0, 3.0), stiffnesses=(9e3,), dampings=(6.0,)), np.random.default_rng(2)
    period = 3 * multisine(1800, range(3, 90, 2), generator)
    files = []
    for k in range(2):
        torque, q = axis.run(np.tile(period, 4))
        seen = q[:, 0] + 1e-6 * generator.normal(size=len(q))
        files.append(
            write(tmp_path / f"r{k}.csv", {"t": STEP * np.arange(len(q)), "tau1": torque, "q1": seen}, ";")
        )
    assert run([*files, "--out", tmp_path / "out"]) == 0
    found = results(tmp_path / "out")
    assert found["excitation"]["period_s"] == pytest.approx(1.8)
    assert found["masses"]["count"] == 2 and inside(found["masses"]["parameters"]["stiffness_1"], 9e3)
    assert found["halves"]["ratio"] < 1.5
    assert found["verdict"]["trusted"] is True
    assert "repeats itself every 1.8 s" in capsys.readouterr().out


def test_feedback_biases_without_a_reference_and_not_with_it(tmp_path: Path) -> None:
    """Coarse encoder, stiff loop: the fed-back noise is a visible part of the torque."""
    axis, generator = Axis(inertias=(2.0, 3.0), stiffnesses=(9e3,), dampings=(6.0,)), np.random.default_rng(3)
    asked = 15 * generator.normal(size=20000)
    torque, q = axis.run(asked, noise=2e-4 * generator.normal(size=20000), gains=(2e4, 300.0))
    file = write(
        tmp_path / "loop.csv",
        {"t": STEP * np.arange(20000), "asked": asked, "torque [Nm]": torque, "motor angle [rad]": q[:, 0]},
    )
    error, square = {}, {}
    for name, more in (("plain", []), ("reference", ["--reference", "asked"])):
        assert run([file, "--band", 3, 30, *more, "--out", tmp_path / name]) == 0
        with np.load(tmp_path / name / "response.npz") as stored:
            truth = axis.response(stored["frequencies_hz"])[:, 0]
            ratio, std = stored["response"][:, 0, 0] / truth, stored["std"][:, 0, 0] / abs(truth)
            error[name] = abs(np.median(ratio.real) - 1)
            square[name] = np.mean(np.abs(ratio - 1) ** 2 / std**2)  # 1 of errors that the covariance tells
    assert error["plain"] > 0.1 and error["reference"] < 0.5 * error["plain"]
    assert square["plain"] > 2.5 and square["reference"] < 1.3
    bias = results(tmp_path / "plain")["feedback"]["bias"]
    assert 0.1 < bias < 0.4


def test_the_tip_is_no_motor(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    axis, generator = Axis(), np.random.default_rng(4)
    torque, q = axis.run(chirp(8000, 2.0, 50.0, 20.0))
    tip = q[:, 2] + 1e-7 * generator.normal(size=8000)
    file = write(tmp_path / "tip.csv", {"t": STEP * np.arange(8000), "torque": torque, "tip": tip})
    assert run([file, "--out", tmp_path / "out"]) == 2
    assert_refusal(capsys.readouterr().err, "E-IMPORT-001", "--output COLUMN=position")
    assert run([file, "--output", "tip=position", "--out", tmp_path / "out"]) == 0
    found = results(tmp_path / "out")
    assert found["masses"]["count"] == 0 and "first --output" in found["masses"]["reason"]
    assert found["resonances"][0]["frequency_hz"]["estimate"] == pytest.approx(
        axis.resonances[0][0], rel=0.002
    )


def test_a_blow_at_rest(tmp_path: Path) -> None:
    axis, generator = Axis(), np.random.default_rng(5)
    force = np.zeros(6000)
    force[20:24] = 300, 800, 800, 300
    _, q = axis.run(force)
    tip = np.diff(q[:, 0], 2, prepend=[0.0, 0.0]) / STEP**2 + 0.01 * generator.normal(size=6000)
    file = write(
        tmp_path / "blow.csv",
        {"t": STEP * np.arange(6000), "Force [N]": force, "acc [m/s^2]": np.roll(tip, -1)},
    )
    assert run([file, "--band", 2, 60, "--out", tmp_path / "out"]) == 0
    found = [item["frequency_hz"]["estimate"] for item in results(tmp_path / "out")["resonances"]]
    assert found == pytest.approx(list(axis.resonances[0]), rel=0.005)


@pytest.mark.parametrize(
    ("columns", "options", "refusal"),
    [
        ({"t": "t", "i": "u", "q": "y"}, ["--masses", "4"], ["E-CLI-033", "1", "3"]),
        ({"t": "t", "i": "u", "q": "y"}, ["--input", "torque"], ["E-IMPORT-003", "torque"]),
        (
            {"t": "t", "i": "u", "q": "y"},
            ["--output", "q=speed"],
            ["E-IMPORT-002", "position, velocity, acceleration"],
        ),
        ({"i": "u", "q": "y"}, [], ["E-IMPORT-009"]),
        ({"t": "back", "i": "u", "q": "y"}, [], ["E-IMPORT-010"]),
        ({"t": "t", "i": "noise", "q": "y"}, [], ["E-RUN-078"]),
    ],
)
def test_what_cannot_be_used_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture, columns: dict, options: list, refusal: list[str]
) -> None:
    generator = np.random.default_rng(6)
    t = STEP * np.arange(2000)
    back = t.copy()
    back[1000:] -= 0.5
    values = {
        "t": t,
        "back": back,
        "u": generator.normal(size=2000),
        "y": np.cumsum(generator.normal(size=2000)),
    }
    values["noise"] = generator.normal(size=2000)
    file = write(tmp_path / "x.csv", {name: values[key] for name, key in columns.items()})
    assert run([file, *options, "--out", tmp_path / "out"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") <= 3
    assert_refusal(said, *refusal)


@pytest.mark.skipif(
    not LINK.is_dir(), reason="FLEXCAL_DATASETS names no folder with the records of the flexible link"
)
def test_the_3_hz_mode_of_a_flexible_link(tmp_path: Path) -> None:
    files = sorted(LINK.glob("swept*.txt"))
    assert len(files) == 10
    run(
        [
            *files,
            "--input",
            "v",
            "--output",
            "theta",
            "a=acceleration",
            "--band",
            1,
            10,
            "--out",
            tmp_path / "out",
        ]
    )
    found = results(tmp_path / "out")
    assert found["elements"][1]["coherence"] > 0.998
    (peak,) = found["elements"][1]["peaks"]
    assert inside(peak["frequency_hz"], 3.0)
    assert peak["frequency_hz"]["high"] - peak["frequency_hz"]["low"] < 0.5
