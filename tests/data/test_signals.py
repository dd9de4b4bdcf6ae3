"""`signals:` of robot.yaml, against the formula written out, and one sentence with its line for what does not fit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

from flexcal.data.tables import assign, open_table
from flexcal.data.tables.signals import read_matrix
from flexcal.units import DEGREE


def values(path: Path, robot: Any, quantity: str) -> np.ndarray:
    file = open_table(path)
    return assign(file, robot, (quantity,), ())[quantity].values(file.read())


def test_formula(tmp_path: Path, make_robot: Callable[..., Any]) -> None:
    (tmp_path / "m.csv").write_text("# joint from motor\n1, 0.5, 0\n0, -2, 1e-1\n")
    robot = make_robot(
        "  q: {columns: [a, b, c], unit: deg, gain: [2, 3, 4], matrix: m.csv, offset: [10, -90]}"
    )
    (tmp_path / "log.csv").write_text("a,b,c\n1,2,3\n-4,5,6\n")
    raw = np.array([[1.0, 2, 3], [-4, 5, 6]])
    matrix = np.array([[1, 0.5, 0], [0, -2, 0.1]])
    expected = raw * DEGREE * np.array([2.0, 3, 4]) @ matrix.T + np.array([10, -90]) * DEGREE
    assert np.allclose(values(tmp_path / "log.csv", robot, "q"), expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("quantity", "unit", "factor"),
    [
        ("q", "turn", 2 * np.pi),
        ("dq", "rpm", np.pi / 30),
        ("dq", "deg/s", DEGREE),
        ("tau", "N m", 1.0),
        ("t", "ms", 1e-3),
        ("payload", "g", 1e-3),
        ("xyz", "mm", 1e-3),
        ("sigma", "um", 1e-6),
    ],
)
def test_units(
    tmp_path: Path, make_robot: Callable[..., Any], quantity: str, unit: str, factor: float
) -> None:
    count = {"q": 2, "dq": 2, "tau": 2, "xyz": 3}.get(quantity, 1)
    names = [f"c{i}" for i in range(count)]
    robot = make_robot(f"  {quantity}: {{columns: [{', '.join(names)}], unit: {unit}}}")
    (tmp_path / "log.csv").write_text(",".join(names) + "\n" + ",".join(["7"] * count) + "\n")
    assert values(tmp_path / "log.csv", robot, quantity) == pytest.approx(7 * factor)


@pytest.mark.parametrize(
    ("line", "refusal"),
    [
        ("  w: {columns: [a, b]}", ["E-TABLE-008", "known are t, q"]),
        ("  tauu: {columns: [a, b]}", ["E-TABLE-008", "tau"]),
        ("  q: {columns: [a, b], unit: degrees}", ["E-TABLE-009", "degrees", "rad, deg"]),
        ("  q: {columns: [a, b], unit: A}", ["E-TABLE-009", "A"]),
        ("  tau: {columns: [a, b], unit: A}", ["E-TABLE-010"]),
        ("  q: {columns: [a, a]}", ["E-TABLE-011"]),
        ("  q: {columns: [a]}", ["E-TABLE-015", "1", "2", "q1, q2"]),
        ("  q: {columns: [a, b], gain: [1]}", ["E-TABLE-012", "1", "2"]),
        ("  q: {columns: [a, b], offset: [1]}", ["E-TABLE-013", "1", "2"]),
        ("  q: {columns: [a, b, c], matrix: two.csv}", ["E-TABLE-014", "two.csv", "2", "2", "2", "3"]),
    ],
)
def test_sentences(tmp_path: Path, make_robot: Callable[..., Any], line: str, refusal: list[str]) -> None:
    (tmp_path / "two.csv").write_text("1,0\n0,1\n")
    (tmp_path / "log.csv").write_text("a,b\n1,2\n")
    with refused(*refusal) as caught:
        values(tmp_path / "log.csv", make_robot(line), "q")
    assert str(caught.value).startswith(f"{tmp_path / 'robot.yaml'} line 3: signals.")


def test_columns_of_signals_that_are_missing(tmp_path: Path, make_robot: Callable[..., Any]) -> None:
    robot = make_robot("  q: {columns: [a, b]}")
    (tmp_path / "log.csv").write_text("a\n1\n")
    with refused("E-TABLE-005", "b", "q"):
        values(tmp_path / "log.csv", robot, "q")
    (tmp_path / "log.csv").write_text("c\n1\n")
    with refused("E-TABLE-006", "q1", "a, b"):
        values(tmp_path / "log.csv", robot, "q")


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("1,0\n0\n", ["E-TABLE-017", "line 2"]),
        ("1,0\n0,x\n", ["E-TABLE-016", "line 2, column 2", "x"]),
        ("1,nan\n", ["E-TABLE-017"]),
        ("\n", ["E-TABLE-018"]),
    ],
)
def test_matrix(tmp_path: Path, text: str, refusal: list[str]) -> None:
    (tmp_path / "m.csv").write_text(text)
    with refused(*refusal):
        read_matrix(tmp_path / "m.csv")
    with refused("E-FILE-001", "none.csv", "No such file or directory"):
        read_matrix(tmp_path / "none.csv")
