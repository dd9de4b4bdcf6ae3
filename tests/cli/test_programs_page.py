"""docs/programs.md: its commands and its script run as they stand, in a folder with what the page says is there, and say what it says."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from six_axis_arm import IRB120

from flexcal.cli.main import main

_NUMBER = r"(?<![\w.])-?\d+(?:\.\d+)?"
_ROUNDED = 2e-2
"""Difference (mm, °) between the numbers of the page and those of another processor."""


@pytest.fixture
def page(root: Path, examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    text = (root / "docs" / "programs.md").read_text("utf-8")
    shutil.copytree(examples / "irb120_program", tmp_path, dirs_exist_ok=True)
    (robot,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    assert (tmp_path / "robot.yaml").read_text("utf-8") == robot
    (program,) = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    assert (tmp_path / "pick.mod").read_text("utf-8") == program
    monkeypatch.chdir(tmp_path)
    return text


def test_the_example_is_of_the_arm_that_programs_are_tried_on(examples: Path, tmp_path: Path) -> None:
    """Measured by its own kinematics, with 15 µm of noise."""
    IRB120.true_one(3).measured(tmp_path, np.array([0.031, 0.0, 0.1]))
    for name in ("points.csv", "others.csv"):
        own, shipped = (
            np.genfromtxt(folder / name, delimiter=",", skip_header=1)
            for folder in (tmp_path, examples / "irb120_program")
        )
        np.testing.assert_allclose(shipped, own, rtol=0, atol=1e-8)
    assert (tmp_path / "arm.urdf").read_text("utf-8") == (examples / "irb120_program" / "arm.urdf").read_text(
        "utf-8"
    )


def test_every_command_of_the_page_runs(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"```console\n(.*?)```", page, re.DOTALL)
    compared = 0
    for line, said in re.findall(r"^\$ (.*)\n((?:(?!\$ ).+\n)*)", "".join(blocks), re.MULTILINE):
        words = shlex.split(line)
        assert words[0] == "flexcal" and main(words[1:]) == 0, line
        told = capsys.readouterr().out
        for shown in said.splitlines():
            compared += 1
            assert any(alike(shown, found) for found in told.splitlines()), (shown, told)
    assert compared == 8
    before, after, back = (Path(name).read_text() for name in ("pick.mod", "corrected.mod", "original.mod"))
    changed = [
        k
        for k, (old, new) in enumerate(zip(before.split("\n"), after.split("\n"), strict=True), 1)
        if old != new
    ]
    assert changed == [4, 5, 6, 7]
    first, last = (
        np.array(re.findall(_NUMBER, re.sub(r",\[-?\d,-?\d,-?\d,\d\](?=,\[9E9)", "", text)), float)
        for text in (before, back)
    )
    np.testing.assert_allclose(last, first, atol=1e-6)
    assert "4 of 5 targets corrected" in Path("pick.html").read_text("utf-8")


def test_the_script_of_the_page_runs(page: str) -> None:
    assert main(["calibrate", "robot.yaml", "points.csv", "--out", "calibration"]) == 0
    (script,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "4 targets corrected" in done.stdout
    assert Path("corrected.mod").is_file() and Path("pick.html").is_file()


def alike(shown: str, found: str) -> bool:
    """Whether two lines are the same but for rounding."""
    if re.sub(_NUMBER, "#", shown) != re.sub(_NUMBER, "#", found):
        return False
    one, other = (np.array(re.findall(_NUMBER, text), dtype=float) for text in (shown, found))
    return bool(np.allclose(one, other, atol=_ROUNDED, rtol=0))
