"""`flexcal import`: what it shows, writes and refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars
import pytest
from cli_files import read_csv, snapshot, write_csv
from refusals import assert_refusal

from flexcal.data.poses import read_poses
from flexcal.data.recordings import read_recording, read_recording_blocks
from flexcal.model.robot import RobotModel


@pytest.fixture
def foreign(ur5_folder: Path) -> Path:
    """Forty published poses of the UR5 in degrees and millimetres, under other names, the third joint counted the other way."""
    header, rows = read_csv(ur5_folder / "grid.csv")
    rows = rows[::25]
    rows[:, 1:7] = np.rad2deg(rows[:, 1:7]) * [1, 1, -1, 1, 1, 1]
    rows[:, 7:] *= 1e3
    names = ["No", *(f"axis {i}" for i in range(1, 7)), "tracker x", "tracker y", "tracker z"]
    assert header[0] == "pose" and len(names) == len(header)
    return write_csv(ur5_folder / "other.csv", names, rows)


def test_a_wrong_sign_is_found_and_mapped(run, ur5_folder: Path, foreign: Path) -> None:
    robot, out = ur5_folder / "robot.yaml", ur5_folder / "poses.csv"
    before = snapshot(ur5_folder)
    refused = run("import", robot, foreign, "--out", out)
    assert refused.status == 2 and snapshot(ur5_folder) == before
    assert_refusal(
        refused.err, "E-CLI-035", "elbow_joint seems to have the opposite sign: --map 'q3=-axis 3[deg]'"
    )
    assert run("import", robot, foreign, "--out", out, "--map", "q3=-axis 3[deg]").status == 0
    model = RobotModel.from_yaml(robot, estimates=False)
    poses, published = read_poses(out, model), read_poses(ur5_folder / "grid.csv", model)
    np.testing.assert_allclose(poses.q, published.q[::25], rtol=1e-12)
    np.testing.assert_allclose(poses.position, published.position[::25], rtol=1e-12)


def test_unchecked_writes_all_the_same(run, ur5_folder: Path, foreign: Path) -> None:
    out = ur5_folder / "poses.csv"
    outcome = run("import", ur5_folder / "robot.yaml", foreign, "--out", out, "--unchecked", "--json")
    assert outcome.status == 0 and out.exists()
    nominal = outcome.document["nominal"]
    assert nominal["doubtful"] and nominal["map"] == ["q3=-axis 3[deg]"]
    assert outcome.document["columns"]["x"] | {"why": ""} == {
        "from": "tracker x",
        "unit": "mm",
        "gain": 1.0,
        "offset": 0.0,
        "why": "",
    }


def test_a_log_and_its_signals(run, ur5_folder: Path, rng: np.random.Generator) -> None:
    t = np.arange(200)
    rows = np.column_stack([4.0 * t, 20 * rng.normal(size=(200, 6)), rng.normal(size=(200, 6))])
    names = ["Zeit [ms]", *(f"A{i}" for i in range(1, 7)), *(f"Strom {i} [A]" for i in range(1, 7))]
    log = write_csv(ur5_folder / "log_of_today.csv", names, rows)
    robot, out = ur5_folder / "robot.yaml", ur5_folder / "log.parquet"
    gains = [f"tau{i}={i}.5*Strom {i} [A][A]" for i in range(1, 7)]
    outcome = run("import", robot, log, "--map", *gains, "--out", out, "--write-signals", "--json")
    assert outcome.status == 0 and "flexcal identify dynamics" in outcome.err
    assert outcome.document["kind"] == "log" and outcome.document["left_out"] == {}
    from flexcal.data.recordings import read_recording

    model = RobotModel.from_yaml(robot, estimates=False)
    converted, direct = read_recording(out, model), read_recording(log, model)
    np.testing.assert_allclose(converted.q, np.deg2rad(rows[:, 1:7]), rtol=1e-12)
    np.testing.assert_allclose(converted.torque, rows[:, 7:] * (np.arange(1, 7) + 0.5), rtol=1e-12)
    np.testing.assert_allclose(direct.torque, converted.torque, rtol=1e-12)
    assert converted.time_step == pytest.approx(4e-3) and direct.time_step == pytest.approx(4e-3)
    assert run("import", robot, log, "--map", *gains, "--write-signals").status == 0, (
        "what stands there already is no conflict"
    )


def without_last_cell(text: str, row: int) -> str:
    """The table with n/a in the last cell of a line (from 0)."""
    lines = text.splitlines()
    lines[row] = lines[row].rsplit(",", 1)[0] + ",n/a"
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("change", "refusal"),
    [
        (lambda text: text.replace("axis 5", "speed 5"), ["E-RUN-084", "q1 … q6", "there are 5 of them, but 6 joints"]),
        (lambda text: without_last_cell(text, 3), ["E-RUN-085", "other.csv line 4, column tracker z", "no number"]),
        (lambda text: text.splitlines()[0], ["E-IMPORT-053", "other.csv"]),
    ],
)  # fmt: skip
def test_faults_are_named_with_their_place(
    run, ur5_folder: Path, foreign: Path, change, refusal: list[str]
) -> None:
    foreign.write_text(change(foreign.read_text()))
    outcome = run("import", ur5_folder / "robot.yaml", foreign)
    assert outcome.status == 2 and outcome.err.count("\n") == 1
    assert_refusal(outcome.err, *refusal)


def test_points_that_are_left_out_are_named(run, ur5_folder: Path, foreign: Path) -> None:
    foreign.write_text(foreign.read_text().replace("tracker y", "remark"))
    outcome = run("import", ur5_folder / "robot.yaml", foreign)
    assert outcome.status == 0 and "joint positions" in outcome.out
    assert "left out: tracker x, tracker z: no y was recognised beside them" in outcome.out
    assert "left out: remark: not recognised" in outcome.out


def test_the_instruments_noise_is_stated_where_the_file_does_not(run, ur5_folder: Path) -> None:
    robot, grid, out = ur5_folder / "robot.yaml", ur5_folder / "grid.csv", ur5_folder / "poses.csv"
    plan = write_csv(ur5_folder / "plan.csv", ["pose", *(f"q{i}" for i in range(1, 7))], np.eye(7))
    assert "give it with --sigma MM" in run("import", robot, grid).out
    page = run("import", robot, grid, "--sigma", "0.03", "--out", out)
    assert page.status == 0 and "give it with" not in page.out
    poses = read_poses(out, RobotModel.from_yaml(robot, estimates=False))
    assert poses.sigma_given
    np.testing.assert_allclose(poses.sigma, 3e-5)
    for file, sigma, refusal in (
        (out, "0.03", ["E-RUN-088", "poses.csv"]),
        (grid, "0", ["E-RUN-086", "0"]),
        (grid, "nan", ["E-RUN-086", "nan"]),
        (plan, "0.03", ["E-RUN-087", "plan.csv"]),
    ):
        refused = run("import", robot, file, "--sigma", sigma)
        assert refused.status == 2 and refused.err.count("\n") == 1
        assert_refusal(refused.err, *refusal)


def test_one_wild_value_is_named_with_its_line(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "grid.csv")
    for column, code in (("x", "E-POSES-007"), ("q2", "E-TABLE-001")):
        wild = rows[::25].copy()
        wild[3, header.index(column)] = 1e6
        outcome = run("import", ur5_folder / "robot.yaml", write_csv(ur5_folder / "wild.csv", header, wild))
        assert outcome.status == 2
        assert_refusal(outcome.err, code, f"line 5, column {column}")


def test_a_unit_that_is_not_known_is_refused_and_not_guessed(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "grid.csv")
    point = [header.index(name) for name in "xyz"]
    rows = rows[::25].copy()
    rows[:, point] /= 25.4e-3

    def headed(unit: str) -> Path:
        named = [f"{name.upper()} [{unit}]" if name in ("x", "y", "z") else name for name in header]
        return write_csv(ur5_folder / "inches.csv", named, rows)

    out = ur5_folder / "read.csv"
    for unit in ("in", "inch", '"'):
        assert run("import", ur5_folder / "robot.yaml", headed(unit), "--out", out).status == 0
        np.testing.assert_allclose(polars.read_csv(out)["x"], rows[:, point[0]] * 25.4e-3, rtol=1e-12)
    refused = run("import", ur5_folder / "robot.yaml", headed("furlong"))
    assert refused.status == 2
    assert_refusal(refused.err, "E-IMPORT-069", "[furlong]", "X [furlong]", "m, mm, um, cm, in, ft")
    mapped = [f"{name}={name.upper()} [furlong][in]" for name in "xyz"]
    assert run("import", ur5_folder / "robot.yaml", headed("furlong"), "--map", *mapped).status == 0


def test_angles_that_were_converted_are_not_said_to_be_degrees(run, ur5_folder: Path) -> None:
    """A controller's own zero, 200 degrees off, is far past the limits in radians as well."""
    header, rows = read_csv(ur5_folder / "grid.csv")
    rows = rows[::25].copy()
    joint = header.index("q3")
    rows[:, [header.index(f"q{i}") for i in range(1, 7)]] *= 180 / np.pi
    rows[:, joint] = np.abs(rows[:, joint]) + 560
    named = [f"{name} [deg]" if name.startswith("q") else name for name in header]
    named = ["a" + name if name in ("x", "y", "z") else name for name in named]
    file = write_csv(ur5_folder / "zero.csv", named, rows)
    refused = run("import", ur5_folder / "robot.yaml", file)
    assert refused.status == 2 and "look like degrees" not in refused.err
    assert_refusal(refused.err, "E-TABLE-001", "converted to rad already", "another zero", "offset:")
    refused = run("import", ur5_folder / "robot.yaml", file, "--sigma", "0.03")
    assert_refusal(refused.err, "E-RUN-087", "ax, ay, az: not recognised", "--map x=COLUMN[mm]")


def test_a_folder_is_no_file_to_write(run, ur5_folder: Path) -> None:
    before = snapshot(ur5_folder)
    outcome = run("import", ur5_folder / "robot.yaml", ur5_folder / "grid.csv", "--out", ur5_folder)
    assert outcome.status == 2 and snapshot(ur5_folder) == before
    assert_refusal(outcome.err, "E-CLI-010")


def test_timestamps_of_poses(run, ur5_folder: Path) -> None:
    """Poses a minute apart keep when they were measured, in seconds from the first, and are numbered."""
    header, rows = read_csv(ur5_folder / "random.csv")
    robot, out = ur5_folder / "robot.yaml", ur5_folder / "poses.csv"
    lines = ["Zeitstempel;" + ";".join(header[1:])]
    for minute, row in enumerate(rows):
        lines.append(
            f"2026-03-01 12:{minute:02d}:30,5;" + ";".join(f"{v:.9f}".replace(".", ",") for v in row[1:])
        )
    (ur5_folder / "german.csv").write_text("\n".join(lines))
    done = run("import", robot, ur5_folder / "german.csv", "--out", out)
    words = " ".join(done.out.split())
    assert done.status == 0 and "Zeitstempel counts in seconds from 2026-03-01 12:00:30,5" in words
    assert "timestamps, as seconds" in words
    poses = read_poses(out, RobotModel.from_yaml(robot, estimates=False))
    np.testing.assert_allclose(poses.time, 60.0 * np.arange(20))
    np.testing.assert_array_equal(poses.pose, np.arange(1, 21))
    np.testing.assert_allclose(poses.position, rows[:, 7:10], atol=1e-8)


def test_a_log_with_timestamps_is_read_by_the_signals_that_import_writes(run, ur5_folder: Path) -> None:
    robot, path, count = ur5_folder / "robot.yaml", ur5_folder / "log.csv", 400
    rng, at = np.random.default_rng(3), 86_398.0 + 0.008 * np.arange(400)
    at += rng.uniform(-2e-3, 2e-3, count)
    q = 0.5 * np.sin(2 * np.pi * 0.7 * at[:, None] + np.arange(6))
    moment = [np.datetime64("2026-03-01T00:00:00") + np.timedelta64(round(1e6 * t), "us") for t in at]
    lines = [
        ",".join([str(m), *(f"{x:.9f}" for x in row), *(f"{10 * x:.6f}" for x in row)])
        for m, row in zip(moment, q, strict=True)
    ]
    header = ["stamp", *(f"q{k}" for k in range(1, 7)), *(f"tau{k}" for k in range(1, 7))]
    path.write_text("\n".join([",".join(header), *lines]))
    done = run("import", robot, path, "--write-signals")
    assert done.status == 0, done.err
    words = " ".join(done.out.split())
    assert "timestamps of stamp are read as seconds from the first" in words and "resample" in words
    model = RobotModel.from_yaml(robot, estimates=False)
    recording = read_recording(path, model)
    exact = 0.5 * np.sin(2 * np.pi * 0.7 * (recording.time[:, None] + at[0]) + np.arange(6))
    np.testing.assert_allclose(recording.q, exact, atol=3e-6)
    blocks = list(read_recording_blocks(path, model, rows=90))
    assert len(blocks) > 1
    np.testing.assert_allclose(np.concatenate([b.q for b in blocks]), recording.q, atol=1e-6)
    path.write_text(path.read_text().replace(str(moment[7]), "later"))
    assert_refusal(
        run("identify", "dynamics", robot, path).err, "E-TABLE-040", "line 9, column stamp", "later"
    )


def test_a_time_that_is_none_is_placed(run, ur5_folder: Path, foreign: Path) -> None:
    lines = foreign.read_text().splitlines()
    stamps = ["when", *(f"2026-03-01 12:{k:02d}:00" for k in range(len(lines) - 1))]
    stamps[7] = "later"
    foreign.write_text("\n".join(f"{stamp},{line}" for stamp, line in zip(stamps, lines, strict=True)))
    sign = "q3=-axis 3[deg]"
    refused = run("import", ur5_folder / "robot.yaml", foreign, "--map", sign)
    assert refused.status == 2
    assert_refusal(refused.err, "E-RUN-085", "other.csv line 8, column when: there is no time")
    assert_refusal(refused.err, "E-RUN-085", "--map t=none")
    assert run("import", ur5_folder / "robot.yaml", foreign, "--map", sign, "t=none").status == 0


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "s"), (1e3, "ms")])
def test_times_of_poses_are_told_by_how_long_one_takes(
    run, ur5_folder: Path, scale: float, unit: str
) -> None:
    header, rows = read_csv(ur5_folder / "random.csv")
    timed = np.column_stack([rows, scale * 40.0 * np.arange(len(rows))])
    file = write_csv(ur5_folder / "timed.csv", [*header, "time"], timed)
    document = run("import", ur5_folder / "robot.yaml", file, "--json").document
    assert document["kind"] == "poses" and document["columns"]["t"]["unit"] == unit
