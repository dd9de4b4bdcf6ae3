"""The commands and the program of docs/simulators.md run as they stand."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

from flexcal.cli.main import main


def test_the_page_runs(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    pytest.importorskip("mujoco", minversion="3.5")
    text = (root / "docs" / "simulators.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```(yaml|sh|python)\n(.*?)```", text, re.DOTALL)
    shutil.copytree(root / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    assert [kind for kind, _ in blocks] == ["yaml", "sh", "python"]
    assert blocks[0][1].strip() in re.sub(r" +#.*", "", Path("examples/servo_arm/robot.yaml").read_text())
    for line in blocks[1][1].splitlines():
        words = shlex.split(line)
        if words[0] == "cp":
            shutil.copytree(words[2], words[3])
        else:
            assert main(words[1:]) == 0, line
    assert "Trusted: yes" in capsys.readouterr().out
    exec(blocks[2][1], {})
    missed = re.search(r"misses ([\d.]+) %", capsys.readouterr().out)
    assert missed is not None and float(missed[1]) < 2.0
