"""Tables of other programs, written by their own libraries or by hand, read back to what was written."""

from __future__ import annotations

import datetime
import sys
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.importing.readers import read_foreign

VALUES = np.array([[1, -12.5, 0.001], [2, 3.25, 7.0], [3, 4e-7, 8.125]])


def read(path: Path, **options):
    return read_foreign(path, (), **options)


def columns(foreign) -> np.ndarray:
    return np.stack(list(foreign.numbers.values()), axis=1)


TEXTS = {
    "commas.csv": "Nr,a,b\n1,-12.5,0.001\n2,3.25,7\n3,4e-7,8.125\n",
    "semicolons.csv": "Nr;a;b\n1;-12,5;0,001\n2;3,25;7\n3;4e-7;8,125\n",
    "tabs.txt": "Nr\ta\tb\n1\t-12.5\t0.001\n2\t3.25\t7\n3\t4e-7\t8.125\n\n",
    "spaces.dat": "Nr    a   b\n 1  -12.5  0.001\n 2  3.25   7\n 3  4e-7  8.125\n",
    "notes.csv": "# made today\nReport, of three\n\nNr,a,b\n[-],[deg],[mm]\n1,-12.5,0.001\n2,3.25,7\n3,4e-7,8.125\n",
    "protocol.csv": "Protokoll;;\nDatum: 03.11.2026;\nBediener: A, B\nNr;a;b\n1;-12,5;0,001\n2;3,25;7\n3;4e-7;8,125\n",
    "quoted.csv": '"Nr","a","b"\r\n"1","-12.5","0.001"\r\n"2","3.25","7"\r\n"3","4e-7","8.125"\r\n',
}


@pytest.mark.parametrize("name", TEXTS)
def test_text(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(TEXTS[name])
    foreign = read(path)
    assert tuple(foreign.numbers) == ("Nr", "a", "b")
    np.testing.assert_array_equal(columns(foreign), VALUES)
    line = (
        int(
            np.flatnonzero(
                [row.replace('"', "").strip().startswith("1") for row in TEXTS[name].splitlines()]
            )[0]
        )
        + 1
    )
    assert foreign.table.first == line
    if name == "notes.csv":
        assert foreign.units == {"Nr": "[-]", "a": "[deg]", "b": "[mm]"}


@pytest.mark.parametrize(
    ("wrong", "refusal"),
    [(3, ["E-IMPORT-045", "4", "2", "3"]), (5, ["E-IMPORT-045", "6", "2", "3"])],
)
def test_the_one_row_of_another_length_is_named(tmp_path: Path, wrong: int, refusal: list[str]) -> None:
    lines = ["Nr;a;b", *(f"{i};{i},5;0,25" for i in range(1, 6))]
    lines[wrong] = lines[wrong].rsplit(";", 1)[0]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    with refused(*refusal):
        read(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("encoding", "header"), [("cp1252", "Winkel [°]"), ("utf-8-sig", "Winkel [°]"), ("utf-16", "θ")]
)
def test_encodings(tmp_path: Path, encoding: str, header: str) -> None:
    (tmp_path / "a.csv").write_text(f"{header},b\n1,2\n3,4\n", encoding=encoding)
    assert tuple(read(tmp_path / "a.csv").numbers) == (header, "b")


def test_text_without_header_texts_and_holes(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1,2.5,ok\n2,,bad\n3,4.5,ok\n")
    foreign = read(tmp_path / "a.csv")
    assert not foreign.named and tuple(foreign.numbers) == ("c1", "c2") and tuple(foreign.texts) == ("c3",)
    assert np.isnan(foreign.numbers["c2"][1])


def test_excel(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "points"
    rows = [["Report"], [], ["Nr", "a", "b", "when"], ["", "deg", "mm", ""]]
    for row in rows + [[*map(float, values), datetime.date(2026, 1, 2).isoformat()] for values in VALUES]:
        sheet.append(row)
    book.create_sheet("other").append(["x", "y"])
    book.save(tmp_path / "a.xlsx")
    foreign = read(tmp_path / "a.xlsx")
    np.testing.assert_array_equal(columns(foreign), VALUES)
    assert foreign.units == {"a": "deg", "b": "mm"} and tuple(foreign.texts) == ("when",)
    assert any("'points'" in note and "--sheet" in note for note in foreign.notes)
    with refused("E-IMPORT-026", "third", "points, other"):
        read(tmp_path / "a.xlsx", sheet="third")
    with refused("E-IMPORT-053"):
        read(tmp_path / "a.xlsx", sheet="other")


def test_mat(tmp_path: Path, rng: np.random.Generator) -> None:
    from scipy.io import savemat

    q, point = rng.normal(size=(20, 6)), rng.normal(size=(3, 20))
    savemat(
        tmp_path / "a.mat",
        {"log": {"q": q, "point": point}, "t": np.arange(20.0)[:, None], "note": "text", "gain": 3.0},
    )
    foreign = read(tmp_path / "a.mat")
    np.testing.assert_array_equal(np.stack([foreign.numbers[f"log.q[{i}]"] for i in range(6)], axis=1), q)
    np.testing.assert_array_equal(foreign.numbers["log.point[2]"], point[2])
    np.testing.assert_array_equal(foreign.numbers["t"], np.arange(20.0))
    assert any("note" in text and "gain" in text for text in foreign.notes)


def write_mat73(path: Path, variables: dict) -> None:
    """As MATLAB lays out version 7.3: HDF5 behind a block of 512 bytes that says so, arrays by columns, structs as groups."""
    import h5py

    def put(group, name: str, value) -> None:
        if isinstance(value, dict):
            group.create_group(name).attrs["MATLAB_class"] = np.bytes_("struct")
            for field, inner in value.items():
                put(group[name], field, inner)
            return
        text = isinstance(value, str)
        matrix = np.atleast_2d(np.array([ord(c) for c in value], np.uint16) if text else np.asarray(value))
        item = group.create_dataset(name, data=matrix.T)
        names = {"float64": "double", "float32": "single", "bool": "logical"}
        item.attrs["MATLAB_class"] = np.bytes_(
            "char" if text else names.get(str(matrix.dtype), str(matrix.dtype))
        )

    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_group("#refs#")
        for name, value in variables.items():
            put(file, name, value)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def test_mat_of_version_7_3(tmp_path: Path, rng: np.random.Generator) -> None:
    """It reads as version 7 does."""
    from scipy.io import savemat

    pytest.importorskip("h5py")
    variables = {
        "log": {
            "q": rng.normal(size=(20, 6)),
            "point": rng.normal(size=(3, 20)),
            "deep": {"n": np.arange(20)},
        },
        "t": np.arange(20.0)[:, None],
        "single": np.linspace(0, 1, 20, dtype=np.float32)[None],
        "on": np.arange(20)[:, None] > 7,
        "note": "text",
        "gain": 3.0,
    }
    savemat(tmp_path / "old.mat", variables)
    write_mat73(tmp_path / "new.mat", variables)
    old, new = read(tmp_path / "old.mat"), read(tmp_path / "new.mat")
    assert set(new.numbers) == set(old.numbers) and len(new.numbers) == 13
    for name, values in old.numbers.items():
        np.testing.assert_array_equal(new.numbers[name], values)
    assert any("note" in text and "gain" in text for text in new.notes)


def test_mat_of_version_7_3_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "new.mat").write_bytes(
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM" + bytes(400)
    )
    pytest.importorskip("h5py")
    with refused("E-IMPORT-030"):
        read(tmp_path / "new.mat")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with refused("E-IMPORT-029"):
        read(tmp_path / "new.mat")


def test_parquet(tmp_path: Path) -> None:
    import polars as pl

    when = [datetime.datetime(2026, 1, 1, 0, 0, second) for second in range(3)]
    frame = pl.DataFrame({"q": VALUES.tolist(), "t": when, "name": ["a", "b", "c"]})
    frame.write_parquet(tmp_path / "a.parquet")
    foreign = read(tmp_path / "a.parquet")
    np.testing.assert_array_equal(np.stack([foreign.numbers[f"q[{k}]"] for k in range(3)], axis=1), VALUES)
    np.testing.assert_allclose(np.diff(foreign.numbers["t"]), 1.0)
    assert foreign.texts["name"].tolist() == ["a", "b", "c"]


@pytest.mark.parametrize(
    ("name", "content", "refusal"),
    [
        ("a.csv", "", ["E-IMPORT-042"]),
        ("a.csv", "just words\nand more\n", ["E-IMPORT-053"]),
        ("a.csv", "a,b\n1,2\n1,2,3\n1,2\n" + "1,2\n" * 300, ["E-IMPORT-045", "3", "3", "2"]),
        ("a.csv", "a,a\n1,2\n", ["E-IMPORT-055", "1", "a"]),
        ("a.csv", "a,b\n1,2\n\n" + "1,2\n" * 300, ["E-IMPORT-044", "3"]),
        ("a.mat", "nothing of the kind", ["E-IMPORT-032"]),
        ("a.parquet", "nothing", ["E-IMPORT-034"]),
        ("a.xlsx", "nothing", ["E-IMPORT-028"]),
        ("a.mcap", "nothing", ["E-IMPORT-036"]),
        ("a.db3", "nothing", ["E-IMPORT-036"]),
        ("a.step", "nothing", ["E-IMPORT-024", ".step"]),
    ],
)
def test_bad_files_are_refused(tmp_path: Path, name: str, content: str, refusal: list[str]) -> None:
    (tmp_path / name).write_text(content)
    with refused(*refusal):
        read(tmp_path / name)
    with refused("E-IMPORT-022"):
        read(tmp_path / f"other_{name}")
