"""Timestamps as texts, against the differences that datetime and Polars find."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pytest

from flexcal.data.tables import seconds_of
from flexcal.importing.columns import guess_columns
from flexcal.importing.readers import read_foreign

FIRST = datetime.datetime(2026, 2, 28, 23, 59, 58, 250_000)
LATER = np.array([0.0, 0.008, 1.75, 2.0, 86_400.125])
STAMPS = [FIRST + datetime.timedelta(seconds=s) for s in LATER]
WRITTEN = {
    "ISO with a T": [s.isoformat(timespec="milliseconds") for s in STAMPS],
    "a space and a comma": [s.isoformat(" ", "milliseconds").replace(".", ",") for s in STAMPS],
    "UTC": [f"{s.isoformat(timespec='microseconds')}Z" for s in STAMPS],
    "summer time": [
        s.replace(tzinfo=datetime.timezone(datetime.timedelta(hours=2))).isoformat() for s in STAMPS
    ],
    "day first": [f"{s:%d.%m.%Y %H:%M:%S},{s.microsecond // 1000:03d}" for s in STAMPS],
    "slashes, nanoseconds": [f"{s:%Y/%m/%d %H:%M:%S.%f}000" for s in STAMPS],
}


@pytest.mark.parametrize("name", WRITTEN)
def test_seconds_from_the_first(name: str) -> None:
    seconds = seconds_of(WRITTEN[name])
    assert seconds is not None
    np.testing.assert_allclose(seconds, LATER, atol=1e-9)


def test_zones_count() -> None:
    """12:00 in Berlin's winter is 11:00 UTC."""
    np.testing.assert_array_equal(
        seconds_of(["2026-03-01T12:00:00+01:00", "2026-03-01T11:00:01Z", "2026-03-01T06:00:02-0500"]),
        [0, 1, 2],
    )


def test_a_time_of_day_passes_midnight() -> None:
    found = seconds_of(["23:59:59.5", "", "0:00:00.25", "12:00:00", "23:59:59,5", "0:00:01"])
    assert found is not None
    np.testing.assert_allclose(found, [0, np.nan, 0.75, 43200.5, 86400, 86401.5])


@pytest.mark.parametrize(
    "texts",
    [
        ["", ""],
        ["ok", "12:00:00"],
        ["ok", "12:00:00", "bad", ""],
        ["2026-02-30 12:00:00"],
        ["25:00:00"],
        ["2026-03-01"],
        ["12:00:00", "2026-03-01 12:00:00"],
    ],
)
def test_other_texts_stay_texts(texts: list[str]) -> None:
    assert seconds_of(texts) is None


@pytest.mark.parametrize("name", WRITTEN)
def test_a_file_with_timestamps(tmp_path: Path, ur5, rng: np.random.Generator, name: str) -> None:
    """The first column of a table with decimal commas is time, whatever it is called."""
    q = rng.uniform(-2, 2, (5, 6))
    rows = ["Messpunkt am;" + ";".join(f"J{i}" for i in range(1, 7))]
    for stamp, joints in zip(WRITTEN[name], q, strict=True):
        rows.append(stamp + ";" + ";".join(f"{v:.6f}".replace(".", ",") for v in joints))
    (tmp_path / "log.csv").write_text("\n".join(rows))
    foreign = read_foreign(tmp_path / "log.csv", ())
    np.testing.assert_allclose(foreign.numbers["J3"], q[:, 2], atol=1e-6)
    np.testing.assert_allclose(foreign.numbers["Messpunkt am"], LATER, atol=1e-9)
    assert foreign.notes == (f"Messpunkt am counts in seconds from {WRITTEN[name][0]}",)
    placed = guess_columns(foreign, ur5).placed["t"]
    assert placed.columns == ("Messpunkt am",) and placed.why == "timestamps, as seconds from the first"
    np.testing.assert_array_equal(placed.values(foreign.table)[:, 0], foreign.numbers["Messpunkt am"])


def test_a_file_of_times_and_one_number(tmp_path: Path) -> None:
    """Rows are found although half of their cells are no numbers, and there are no names."""
    (tmp_path / "a.csv").write_text("2026-03-01 12:00:00,1.5\n2026-03-01 12:00:01,2.5\n")
    foreign = read_foreign(tmp_path / "a.csv", ())
    assert not foreign.named and foreign.numbers["c1"].tolist() == [0, 1]


def test_numbers_go_before_timestamps(made, ur5, rng: np.random.Generator) -> None:
    columns = {"time": np.arange(30.0)} | {f"J{i}": rng.uniform(-2, 2, 30) for i in range(1, 7)}
    foreign = made(columns | {"Uhrzeit": np.arange(30.0)})
    guess = guess_columns(foreign, ur5)
    assert guess.placed["t"].columns == ("time",)
    assert {left.column: left.why for left in guess.left_out} == {"Uhrzeit": "time is taken as t"}


def test_excel_dates(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["when", "clock", "a"])
    for i, stamp in enumerate(STAMPS):
        sheet.append([stamp, stamp.time().replace(microsecond=0), float(i)])
    book.save(tmp_path / "a.xlsx")
    foreign = read_foreign(tmp_path / "a.xlsx", ())
    np.testing.assert_allclose(foreign.numbers["when"], LATER, atol=6e-4)  # Excel keeps milliseconds
    np.testing.assert_allclose(foreign.numbers["clock"], [0, 0, 2, 2, 86400])


def test_parquet_dates(tmp_path: Path) -> None:
    import polars as pl

    pl.DataFrame({"when": [*STAMPS, None], "a": np.arange(6.0)}).write_parquet(tmp_path / "a.parquet")
    foreign = read_foreign(tmp_path / "a.parquet", ())
    np.testing.assert_allclose(foreign.numbers["when"], [*LATER, np.nan], atol=1e-6)
    assert foreign.times == ("when",)
