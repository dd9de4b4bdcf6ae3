"""Joint logs: every fault in one sentence with file, line and column; values come back as they were written."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from refusals import refused

from flexcal.data.recordings import Recording, read_recording, read_recording_blocks, write_recording
from flexcal.units import DEGREE

HEADER = "t,q1,q2,tau1,tau2"


def rows(*times: float) -> list[str]:
    return [f"{t!r},{0.1 + t!r},{0.2 - t!r},{5.0 * t!r},1e0" for t in times]


def log(path: Path, lines: list[str], header: str = HEADER) -> Path:
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def recording(samples: int = 50, step: float = 1 / 3000, start: float = 0.25, **more: Any) -> Recording:
    rng = np.random.default_rng(1)
    return Recording(
        step, rng.uniform(-1, 1, (samples, 2)), rng.normal(0, 50, (samples, 2)), start=start, **more
    )


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_round_trip(tmp_path: Path, robot: Any, ending: str) -> None:
    rng = np.random.default_rng(2)
    more: dict[str, Any] = {
        name: rng.normal(0, 1, (50, 2))
        for name in ("arm", "velocity", "acceleration", "arm_velocity", "external_torque")
    }
    written = recording(**more, temperature=rng.uniform(20, 40, 50))
    write_recording(tmp_path / f"log.{ending}", written)
    again = read_recording(tmp_path / f"log.{ending}", robot)
    for name in ("q", "torque", "temperature", *more):
        assert np.array_equal(getattr(again, name), getattr(written, name)), name
    assert again.time_step == pytest.approx(1 / 3000, rel=1e-15)
    assert again.start == pytest.approx(0.25, rel=1e-15)
    assert again.time_base is not None
    assert not again.time_base.resampled
    assert len(list(tmp_path.iterdir())) == 2


def test_absent_quantities_are_none(tmp_path: Path, robot: Any) -> None:
    again = read_recording(log(tmp_path / "log.csv", rows(0, 0.1, 0.2)), robot)
    assert again.arm is None
    assert again.temperature is None
    assert np.allclose(again.q, [[0.1, 0.2], [0.2, 0.1], [0.3, 0.0]])
    assert again.torque[:, 1].tolist() == [1, 1, 1]


def test_comments_spaces_and_windows_lines(tmp_path: Path, robot: Any) -> None:
    text = "\ufeff# measured on Monday\r\n\r\nt, q1, q2, tau1, tau2\r\n0, 1, 2, 3, 4\r\n0.1, 1, 2, 3, 4\r\n\r\n\r\n"
    (tmp_path / "log.csv").write_bytes(text.encode())
    assert read_recording(tmp_path / "log.csv", robot).q.tolist() == [[1, 2], [1, 2]]


def test_rate_survives_rounded_time_stamps(tmp_path: Path, robot: Any) -> None:
    lines = [f"{k / 3000:.6f},0,0,0,0" for k in range(3000)]
    again = read_recording(log(tmp_path / "log.csv", lines), robot)
    assert again.time_step == 1 / 3000
    assert again.time_base is not None
    assert not again.time_base.resampled
    assert again.time_base.jitter == pytest.approx(1e-6 / np.sqrt(12), rel=0.3)


def test_jitter_is_measured_and_interpolated(tmp_path: Path, robot: Any) -> None:
    rng = np.random.default_rng(3)
    t = np.arange(4000) / 1000 + rng.uniform(-2e-4, 2e-4, 4000)
    signal = np.sin(2 * np.pi * 20 * t)
    write = pl.DataFrame({"t": t, "q1": signal, "q2": t, "tau1": signal, "tau2": 0 * t})
    write.write_parquet(tmp_path / "log.parquet")
    again = read_recording(tmp_path / "log.parquet", robot)
    assert again.time_base is not None
    assert again.time_base.resampled
    assert again.time_base.jitter == pytest.approx(4e-4 / np.sqrt(12), rel=0.05)
    assert again.time_step == 1e-3
    inner = slice(3, -3)
    assert np.abs(again.q[:, 0] - np.sin(2 * np.pi * 20 * again.time))[inner].max() < 1e-5
    assert np.abs(again.q[:, 1] - again.time)[inner].max() < 1e-12


def test_one_lost_sample_is_filled_in(tmp_path: Path, robot: Any) -> None:
    times = [0.1 * k for k in range(20) if k != 7]
    again = read_recording(log(tmp_path / "log.csv", rows(*times)), robot)
    assert len(again) == 20
    assert again.time_base is not None
    assert again.time_base.lost == 1
    assert np.allclose(again.q[:, 0], 0.1 + again.time)


@pytest.mark.parametrize(
    ("header", "lines", "refusal"),
    [
        ("t,q1,q2,tau1", [], ["E-TABLE-007", "line 1", "1", "2", "tau1…tau2"]),
        ("t,q1,q2", [], ["E-TABLE-006", "line 1", "tau1", "add it"]),
        ("q1,q2,tau1,tau2", [], ["E-TABLE-006", "line 1", "t"]),
        ("time,q1,q2,tau1,tau2", [], ["E-TABLE-006", "line 1", "t"]),
        ("t,q1,tau1,tau2", [], ["E-TABLE-007", "line 1", "1", "q1…q1", "2"]),
        ("t,q1,q2,q3,tau1,tau2,tau3", [], ["E-TABLE-007", "line 1", "3", "q1…q3", "2"]),
        ("t,q1,q2,tau1,tau2,qa1", [], ["E-TABLE-007", "line 1", "qa1…qa1", "2"]),
        ("t,q1,q2,tau1,tau2,qa2", [], ["E-TABLE-006", "line 1", "qa1"]),
        ("t,q1,q2,tau1,tau2,temperatur", [], ["E-TABLE-004", "line 1", "temperatur", "temperature"]),
        ("t,q1,q2,tau1,tau2,foo", [], ["E-TABLE-004", "line 1", "foo", "remove it"]),
        ("t,q1,q2,tau1,q1", [], ["E-TABLE-024", "line 1", "q1"]),
        ("t,q1,q2,tau1,", [], ["E-TABLE-031", "1", "5"]),
        ("t;q1;q2;tau1;tau2", [], ["E-TABLE-029", "1"]),
        ("0,1,2,3,4", [], ["E-TABLE-030", "1"]),
        (HEADER, [], ["E-TABLE-019", "line 1"]),
        (HEADER, ["0,0,0,0,0"], ["E-LOG-016", "line 2"]),
        (HEADER, ["0,0,0,0,0", "0.1,0,NaN,0,0"], ["E-TABLE-036", "3", "q2", "NaN", "no measurement"]),
        (HEADER, ["0,0,0,0,0", "0.1,0,0,-inf,0"], ["E-TABLE-036", "3", "tau1", "-inf"]),
        (HEADER, ["0,0,0,0,0", "0.1,0,0,0,"], ["E-TABLE-036", "3", "tau2", "missing"]),
        (HEADER, ["0,0,0,0,0", "0.1,0,0,0"], ["E-TABLE-035", "3", "4", "5"]),
        (HEADER, ["0,0,0,0,0", "0.1,0,0,0,0,0"], ["E-TABLE-035", "3", "6", "5"]),
        (HEADER, ["0,0,0,0,0", "", "0.1,0,0,0,0"], ["E-TABLE-034", "3"]),
        (HEADER, ["0,0,0,0,0", "0.1,0,zero,0,0"], ["E-TABLE-036", "3", "q2", "'zero' is not a number"]),
        (HEADER, ["0,0,0,0,0", '0.1,0,"1,5",0,0'], ["E-TABLE-036", "3", "q2", "decimal point"]),
        (HEADER, ["0,0,0,0,0", "0.2,0,0,0,0", "0.1,0,0,0,0"], ["E-LOG-017", "line 4, column t"]),
        (HEADER, ["0.2,0,0,0,0", "0.2,0,0,0,0"], ["E-LOG-018", "line 3, column t"]),
        (HEADER, ["0,0,0,0,0", *6 * ["0.2,0,0,0,0"]], ["E-LOG-018", "line 4", "6"]),
        (
            HEADER,
            [f"{t},0,0,0,0" for t in (0.0, 0.1, 0.2, 0.3, 0.8, 0.9, 1.0)],
            ["E-LOG-011", "line 6, column t", "0.5", "0.1"],
        ),
        (
            HEADER,
            [f"{t},0,0,0,0" for t in (0.0, 0.1, 0.2, 0.3, 0.8, 0.9, 1.0, 2.0, 2.1)],
            ["E-LOG-011", "line 6", "first of 2"],
        ),
        (
            HEADER,
            ["0,0,0,0,0", "5,0,0,0,0", "10,0,0,0,0"],
            ["E-LOG-019", "line 2, column t", "unit: ms"],
        ),
        (HEADER, ["0,0,0,0,0", "1e-9,0,0,0,0"], ["E-LOG-019", "line 2, column t", "check its unit"]),
        (
            HEADER,
            ["0,1,2,0,0", "0.1,0,-45.5,0,0"],
            ["E-TABLE-001", "line 3, column q2", "elbow", "degrees", "unit: deg"],
        ),
        (
            HEADER,
            ["0,1,2,0,0", "0.1,0,1e6,0,0"],
            ["E-TABLE-001", "line 3, column q2", "elbow", "order of the columns"],
        ),
    ],
)
def test_sentences(tmp_path: Path, robot: Any, header: str, lines: list[str], refusal: list[str]) -> None:
    with refused(*refusal) as caught:
        read_recording(log(tmp_path / "log.csv", lines, header), robot)
    assert str(caught.value).startswith(str(tmp_path / "log.csv"))


def test_files_that_cannot_be_read(tmp_path: Path, robot: Any) -> None:
    with refused("E-FILE-001"):
        read_recording(tmp_path / "none.csv", robot)
    with refused("E-TABLE-023"):
        read_recording(tmp_path / "log.xlsx", robot)
    (tmp_path / "log.parquet").write_text("no parquet")
    with refused("E-TABLE-027"):
        read_recording(tmp_path / "log.parquet", robot)
    (tmp_path / "log.csv").write_bytes(b"t,q1\n\xff")
    with refused("E-TABLE-007", "line 1"):
        read_recording(tmp_path / "log.csv", robot)
    (tmp_path / "empty.csv").write_text("\n# nothing\n")
    with refused("E-TABLE-032", "empty.csv"):
        read_recording(tmp_path / "empty.csv", robot)
    (tmp_path / "latin.csv").write_bytes((HEADER + "\n0,0,0,0,\xe9\n").encode("latin-1"))
    with refused("E-TABLE-033", "2"):
        read_recording(tmp_path / "latin.csv", robot)


def test_rows_of_parquet(tmp_path: Path, robot: Any) -> None:
    names = HEADER.split(",")
    frame = pl.DataFrame([[0.0, 0.1], [0.0, None], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]], schema=names)
    frame.write_parquet(tmp_path / "log.parquet")
    with refused("E-TABLE-038", "row 2, column q1"):
        read_recording(tmp_path / "log.parquet", robot)
    frame.with_columns(q1=pl.Series([0.0, np.nan])).write_parquet(tmp_path / "log.parquet")
    with refused("E-TABLE-039", "row 2, column q1", "nan"):
        read_recording(tmp_path / "log.parquet", robot)
    frame.with_columns(q1=pl.Series(["a", "b"])).write_parquet(tmp_path / "log.parquet")
    with refused("E-TABLE-020", "q1", "String"):
        read_recording(tmp_path / "log.parquet", robot)


def test_milliseconds_and_degrees_by_signals(tmp_path: Path, make_robot: Callable[..., Any]) -> None:
    robot = make_robot(
        "  t: {columns: [time], unit: ms}\n  q: {columns: [m1, m2], unit: deg, offset: [0, -90]}\n"
        "  tau: {columns: [i1, i2], unit: A, gain: [10, 20]}"
    )
    path = log(tmp_path / "log.csv", ["0,10,20,1,2", "100,30,40,3,4"], "time,m1,m2,i1,i2")
    again = read_recording(path, robot)
    assert again.time_step == pytest.approx(0.1)
    assert np.allclose(again.q, np.array([[10, 20 - 90], [30, 40 - 90]]) * DEGREE)
    assert again.torque.tolist() == [[10, 40], [30, 80]]


def make_long_log(path: Path, samples: int, jitter: float, hole: int | None) -> np.ndarray:
    rng = np.random.default_rng(4)
    t = 5.0 + np.arange(samples) / 1000 + rng.uniform(-jitter, jitter, samples)
    if hole is not None:
        t[hole:] += 0.5
    columns = {"t": t, "q1": np.sin(t), "q2": np.cos(t), "tau1": t, "tau2": -t}
    frame = pl.DataFrame(columns)
    frame.write_csv(path) if path.suffix == ".csv" else frame.write_parquet(path)
    return t


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("jitter", [0.0, 2e-4])
def test_blocks_join_to_the_whole(tmp_path: Path, robot: Any, ending: str, jitter: float) -> None:
    path = tmp_path / f"log.{ending}"
    make_long_log(path, 5000, jitter, None)
    whole = read_recording(path, robot)
    blocks = list(read_recording_blocks(path, robot, rows=700))
    assert len(blocks) > 5
    assert max(len(block) for block in blocks) < 2000
    for earlier, later in pairwise(blocks):
        assert later.time_step == earlier.time_step
        assert later.start == pytest.approx(earlier.start + len(earlier) * earlier.time_step, abs=1e-9)
        assert later.time_base is not None
        assert later.time_base.gap == 0.0
    assert abs(sum(len(block) for block in blocks) - len(whole)) <= 1
    q = np.concatenate([block.q for block in blocks])
    time = np.concatenate([block.time for block in blocks])
    if jitter == 0.0:
        assert np.array_equal(q, whole.q)
        assert np.allclose(time, whole.time, rtol=0, atol=1e-9)
    assert np.abs(q[3:-3] - np.stack([np.sin(time), np.cos(time)], axis=1)[3:-3]).max() < 1e-9
    assert np.abs(np.concatenate([block.torque for block in blocks])[:, 0] - time)[3:-3].max() < 1e-9


@pytest.mark.parametrize("hole", [1, 2, 699, 700, 701, 1500, 1999])
def test_blocks_restart_after_a_gap(tmp_path: Path, robot: Any, hole: int) -> None:
    path = tmp_path / "log.csv"
    t = make_long_log(path, 2000, 0.0, hole)
    with refused("E-LOG-011", f"line {hole + 2}, column t", "0.501"):
        read_recording(path, robot)
    blocks = list(read_recording_blocks(path, robot, rows=700))
    time = np.concatenate([block.time for block in blocks])
    assert np.allclose(time, t, rtol=0, atol=1e-8)
    q = np.concatenate([block.q for block in blocks])
    assert np.allclose(q, np.stack([np.sin(t), np.cos(t)], axis=1), rtol=0, atol=1e-9)
    found = [block.time_base.gap for block in blocks if block.time_base and block.time_base.gap]
    assert found == [pytest.approx(0.501)]


@pytest.mark.parametrize("put_down", [120, 150])
def test_a_payload_that_is_put_down_on_the_way(tmp_path: Path, robot: Any, put_down: int) -> None:
    """Inside a block or where one ends."""
    path, k = tmp_path / "log.parquet", np.arange(400)
    columns = {name: np.zeros(400) for name in HEADER.split(",")}
    pl.DataFrame(columns | {"t": k / 100, "payload": 4.0 * (k < put_down)}).write_parquet(path)
    with refused("E-LOG-015", f"row {put_down + 1}, column payload", "0", "4"):
        list(read_recording_blocks(path, robot, rows=50))


def test_blocks_find_the_same_faults(tmp_path: Path, robot: Any) -> None:
    path = log(tmp_path / "log.csv", [f"{k / 100},0,0,0,0" for k in range(1000)])
    text = path.read_text().splitlines()

    def check(line: int, content: str, *refusal: str) -> None:
        changed = [*text[: line - 1], content, *text[line:]]
        path.write_text("\n".join(changed) + "\n")
        with refused(*refusal):
            list(read_recording_blocks(path, robot, rows=50))

    check(900, "8.98,nan,0,0,0", "E-TABLE-036", "900", "q1", "nan")
    check(901, "8,0,0,0,0", "E-LOG-017", "line 901, column t")
    check(800, "7.98,0,90,0,0", "E-TABLE-001", "line 800, column q2")
    log(path, [])
    with refused("E-LOG-012"):
        list(read_recording_blocks(path, robot))
    log(path, rows(0))
    with refused("E-LOG-016"):
        list(read_recording_blocks(path, robot))


def test_not_finite_is_not_written(tmp_path: Path) -> None:
    bad = Recording(0.1, np.full((3, 2), np.nan), np.zeros((3, 2)))
    with refused("E-LOG-013"):
        write_recording(tmp_path / "log.csv", bad)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ({"time_step": 0.0, "q": np.zeros((3, 2)), "torque": np.zeros((3, 2))}, "E-LOG-005"),
        ({"time_step": 0.1, "q": np.zeros(3), "torque": np.zeros(3)}, "E-LOG-006"),
        ({"time_step": 0.1, "q": np.zeros((3, 2)), "torque": np.zeros((3, 1))}, "E-LOG-007"),
        (
            {"time_step": 0.1, "q": np.zeros((3, 2)), "torque": np.zeros((3, 2)), "temperature": np.zeros(2)},
            "E-LOG-010",
        ),
    ],
)
def test_shapes_are_checked(arguments: dict[str, Any], code: str) -> None:
    with refused(code):
        Recording(**arguments)
