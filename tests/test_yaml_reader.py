"""The strict YAML reader: numbers of YAML 1.2, dataclasses, one sentence with file and line for every fault."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from refusals import refused

from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import read_yaml, read_yaml_file, write_yaml, yaml_text


@dataclass(frozen=True)
class Spring:
    stiffness: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        if self.stiffness <= 0:
            raise FlexcalError("E-TEST-001", f"the stiffness is {self.stiffness}; give a positive one.")


@dataclass(frozen=True)
class Joint:
    joint: str
    drive: Spring
    bearing: Spring | None = None


@dataclass(frozen=True)
class Config:
    name: str
    elastic: tuple[Joint, ...] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    stations: dict[str, Spring] = field(default_factory=dict)
    terms: Literal["auto", "none"] | list[str] = "auto"
    count: int = 1
    sure: bool = False
    cutoff: float | None = None
    kind: Literal["held", "mean"] = "held"
    matrix: np.ndarray | None = None
    lines: NDArray[np.int64] | None = None
    file: Path | None = None


def read(folder: Path, text: str) -> Config:
    path = folder / "config.yaml"
    path.write_text(text)
    return read_yaml(path, Config)


def check_refused(folder: Path, text: str, code: str, *names: str) -> None:
    """Reading is refused with this code, by one sentence that names the file and these."""
    with refused(code, "config.yaml", *names) as caught:
        read(folder, text)
    message = str(caught.value)
    assert type(caught.value) is InputError and message.endswith((".", "?"))
    assert "\n" not in message


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("143.7e3", 143.7e3),
        ("143.7e+3", 143.7e3),
        ("143.7E3", 143.7e3),
        ("1e3", 1000.0),
        ("1e-3", 1e-3),
        ("-.5", -0.5),
        ("+7", 7.0),
        ("7.", 7.0),
        ("010", 10.0),
        (".5e1", 5.0),
    ],
)
def test_numbers_of_yaml_1_2(tmp_path: Path, text: str, value: float) -> None:
    config = read(tmp_path, f"name: a\ncutoff: {text}\n")
    assert isinstance(config.cutoff, float)
    assert config.cutoff == value


@pytest.mark.parametrize(
    "text", ["'1e3'", "true", "abc", "1e", "1_000", "12:30", "2001-01-01", "[1]", "{a: 1}"]
)
def test_not_a_number(tmp_path: Path, text: str) -> None:
    check_refused(
        tmp_path, f"name: a\n\ncutoff: {text}\n", "E-YAML-033", "line 3", "cutoff", "a number is expected"
    )


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (".nan", "E-YAML-026"),
        (".inf", "E-YAML-026"),
        ("-.INF", "E-YAML-026"),
        ("1e999", "E-YAML-026"),
        ("1" + "0" * 400, "E-YAML-015"),
    ],
)
def test_not_finite(tmp_path: Path, text: str, code: str) -> None:
    check_refused(tmp_path, f"name: a\ncutoff: {text}\n", code, "line 2")


def test_everything_of_a_dataclass(tmp_path: Path) -> None:
    config = read(
        tmp_path,
        "name: 'yes'\nelastic:\n- joint: j1\n  drive: {stiffness: 1e3}\n"
        "  bearing: {stiffness: 2, damping: 3}\n"
        "gravity: [0, 0, -9.81]\nstations: {1: {stiffness: 4}}\nterms: [a, b]\ncount: 4\nsure: true\n"
        "kind: mean\nmatrix: [[1, 2], [3, 4.5]]\nlines: [1, 3]\nfile: tx90l.urdf\n",
    )
    assert config.name == "yes"
    assert config.elastic == (Joint("j1", Spring(1000.0), Spring(2.0, 3.0)),)
    assert config.gravity == (0.0, 0.0, -9.81)
    assert config.stations == {"1": Spring(4.0)}
    assert config.terms == ["a", "b"]
    assert (config.count, config.sure, config.kind, config.file) == (4, True, "mean", Path("tx90l.urdf"))
    assert config.matrix is not None
    assert config.matrix.dtype == float
    assert config.matrix.tolist() == [[1.0, 2.0], [3.0, 4.5]]
    assert config.lines is not None
    assert config.lines.dtype == np.int64
    assert read(tmp_path, "name: a\nterms: auto\n").terms == "auto"


@pytest.mark.parametrize(
    ("text", "line", "refusal"),
    [
        ("name: a\nelastik: []\n", 2, ["E-YAML-001", "elastik", "elastic"]),
        (
            "name: a\nelastic:\n- joint: j\n  drive:\n    stifness: 3\n",
            5,
            ["E-YAML-001", "stifness", "in elastic[0].drive", "stiffness"],
        ),
        ("name: a\nqqqqq: 1\n", 2, ["E-YAML-001", "qqqqq", "known are name, elastic"]),
        ("count: 1\n", 1, ["E-YAML-002", "name", "name"]),
        (
            "name: a\nelastic:\n- joint: j\n  drive: {damping: 1}\n",
            4,
            ["E-YAML-002", "stiffness", "in elastic[0].drive"],
        ),
        (
            "name: a\nelastic:\n- joint: j\n  drive:\n    stiffness: -4\n",
            4,
            ["E-TEST-001", "elastic[0].drive", "stiffness is -4.0"],
        ),
        ("name: 3\n", 1, ["E-YAML-030", "name", "3"]),
        ("name:\n", 1, ["E-YAML-030", "nothing"]),
        ("name: a\ncount: 1.5\n", 2, ["E-YAML-028", "count"]),
        ("name: a\ncount: true\n", 2, ["E-YAML-028", "count"]),
        ("name: a\nsure: yes\n", 2, ["E-YAML-031", "sure"]),
        ("name: a\nkind: meen\n", 2, ["E-YAML-032", "held', 'mean", "mean"]),
        ("name: a\nterms: aut\n", 2, ["E-YAML-033", "'auto' or 'none' or a list"]),
        (
            "name: a\nelastic: text\n",
            2,
            ["E-YAML-023", "elastic", "a list", "write [ ] around its entries", "the text"],
        ),
        ("name: a\nelastic: [3]\n", 2, ["E-YAML-023", "elastic[0]", "a mapping"]),
        ("name: a\nstations: [3]\n", 2, ["E-YAML-023", "stations", "a mapping"]),
        (
            "name: a\nstations:\n  a: {stiffness: 1}\n  b: {stiffness: x}\n",
            4,
            ["E-YAML-025", "stations.b.stiffness"],
        ),
        ("name: a\ngravity: [0, 0]\n", 2, ["E-YAML-024", "gravity", "3"]),
        ("name: a\ngravity:\n- 0\n- x\n- 0\n", 4, ["E-YAML-025", "gravity[1]"]),
        ("name: a\nmatrix:\n- [1, 2]\n- [3]\n", 4, ["E-YAML-020", "matrix[1]"]),
        ("name: a\nmatrix:\n- [1, 2]\n- [3, x]\n", 4, ["E-YAML-025", "matrix[1][1]"]),
        ("name: a\nmatrix: 3\n", 2, ["E-YAML-033", "matrix", "a list"]),
        ("name: a\nlines: [1.5]\n", 2, ["E-YAML-028", "lines[0]"]),
        ("name: a\ncount: 1\nname: b\n", 3, ["E-YAML-014", "name", "1"]),
        ("name: a\n  count: 1\n", 2, ["E-YAML-004"]),
        ("name: [a\n", 2, ["E-YAML-004"]),
        ("name: !!python/name:os.system a\n", 1, ["E-YAML-008"]),
        ("name: a\nstations: &s {a: *s}\n", 2, ["E-YAML-011"]),
        ("? [a]\n: 3\n", 1, ["E-YAML-013"]),
        ("", 1, ["E-YAML-006"]),
        ("- 3\n", 1, ["E-YAML-023", "a mapping"]),
    ],
)
def test_sentences(tmp_path: Path, text: str, line: int, refusal: list[str]) -> None:
    code, *names = refusal
    check_refused(tmp_path, text, code, f"line {line}", *names)


def test_first_fault_first(tmp_path: Path) -> None:
    check_refused(tmp_path, "name: a\ncount: x\nsure: 3\nwrong: 1\n", "E-YAML-028", "line 2")


def test_unreadable_files(tmp_path: Path) -> None:
    with refused("E-FILE-001", "nowhere.yaml"):
        read_yaml(tmp_path / "nowhere.yaml", Config)
    (tmp_path / "latin.yaml").write_bytes("name: é".encode("latin-1"))
    with refused("E-YAML-016", "latin.yaml"):
        read_yaml(tmp_path / "latin.yaml", Config)


def test_lines_of_plain_data(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("a: 1\nb:\n  - c: 3\n  - d: 4\n")
    file = read_yaml_file(tmp_path / "a.yaml")
    assert file.data == {"a": 1, "b": [{"c": 3}, {"d": 4}]}
    assert file.line("b", 1, "d") == 4
    assert file.line("b", 0, "unknown") == 3
    assert str(file.error("E-TEST-001", ("b", 1), "wrong.")) == f"{tmp_path / 'a.yaml'} line 4: wrong."


def test_round_trip(tmp_path: Path) -> None:
    config = Config("a: b", (Joint("1", Spring(0.1 + 0.2)),), count=3, terms=["x"], file=Path("a/b"))
    write_yaml(tmp_path / "a.yaml", config)
    assert read_yaml(tmp_path / "a.yaml", Config) == config
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.yaml"]


@settings(max_examples=200, deadline=None)
@given(
    st.recursive(
        st.none()
        | st.booleans()
        | st.integers()
        | st.floats(allow_nan=False, allow_infinity=False)
        | st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), max_size=8),
        lambda inner: (
            st.lists(inner, max_size=4)
            | st.dictionaries(
                st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), max_size=6),
                inner,
                max_size=4,
            )
        ),
        max_leaves=12,
    )
)
def test_plain_round_trip(tmp_path_factory: pytest.TempPathFactory, data: Any) -> None:
    path = tmp_path_factory.getbasetemp() / "plain.yaml"
    write_yaml(path, {"data": data})
    again = read_yaml_file(path).data["data"]
    assert again == data
    assert yaml_text({"data": again}) == yaml_text({"data": data})


@pytest.mark.parametrize(
    ("value", "refusal"),
    [
        (math.nan, ["E-YAML-017", "data"]),
        (math.inf, ["E-YAML-017", "data"]),
        (np.array([1.0, np.nan]), ["E-YAML-017", "data[1]"]),
        (object(), ["E-YAML-018", "data"]),
    ],
)
def test_what_is_not_written(tmp_path: Path, value: Any, refusal: list[str]) -> None:
    with refused(*refusal):
        write_yaml(tmp_path / "a.yaml", {"data": value})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("depth", [60, 500, 100_000])
@pytest.mark.parametrize("form", ["deep: {}{}\n", "{}1{}\n"], ids=["brackets", "dashes"])
def test_depth_is_bounded(tmp_path: Path, depth: int, form: str) -> None:
    opened, closed = ("[" * depth, "]" * depth) if "deep" in form else ("- " * depth, "")
    check_refused(tmp_path, form.format(opened, closed), "E-YAML-009", "50")


def test_aliases_repeat_a_bounded_number_of_values(tmp_path: Path) -> None:
    levels = "".join(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 10)}]\n" for k in range(12))
    check_refused(tmp_path, "a0: &a0 [1]\n" + levels, "E-YAML-012", "100000")
    text = "name: &n arm\nelastic:\n- {joint: *n, drive: &d {stiffness: 5}}\n- {joint: b, drive: *d, bearing: *d}\n"
    config = read(tmp_path, text)
    assert config.elastic[1] == Joint("b", Spring(5.0), Spring(5.0)) and config.elastic[0].joint == "arm"
    check_refused(tmp_path, "name: x\nterms: &t [*t]\n", "E-YAML-011", "line 2")
    check_refused(tmp_path, "terms: *t\n", "E-YAML-010", "line 1", "'*t'")


@pytest.mark.parametrize(
    ("number", "refusal"),
    [
        ("9" * 5000, ["E-YAML-015", "5000"]),
        ("0x" + "f" * 5000, ["E-YAML-015", "5002"]),
        ("0o9", ["E-YAML-033", "the text '0o9'"]),
        ("1e51", ["E-YAML-027", "1e+50"]),
        ("-1e308", ["E-YAML-027", "1e+50"]),
        ("1e999", ["E-YAML-026"]),
        (str(10**60), ["E-YAML-027", "1e+50"]),
    ],
)
def test_numbers_beyond_reason(tmp_path: Path, number: str, refusal: list[str]) -> None:
    check_refused(tmp_path, f"name: a\ncutoff: {number}\n", *refusal)


@pytest.mark.parametrize("number", [2**63, -(2**63) - 1, 10**40])
def test_whole_numbers_have_eight_bytes(tmp_path: Path, number: int) -> None:
    check_refused(tmp_path, f"name: a\ncount: {number}\n", "E-YAML-029", "count")
    check_refused(tmp_path, f"name: a\nlines: [1, {number}]\n", "E-YAML-029", "lines[1]")


def test_a_second_document_is_refused(tmp_path: Path) -> None:
    check_refused(tmp_path, "name: a\n---\nname: b\n", "E-YAML-007", "line 2")
