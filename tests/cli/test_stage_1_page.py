"""docs/stage-1-on-your-own-robot.md: its commands run as they stand, say what it says, and find what it says."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest
from cli_files import copied
from played_robot import ROBOT, URDF, Robot


def consoles(root: Path) -> list[str]:
    page = (root / "docs" / "stage-1-on-your-own-robot.md").read_text(encoding="utf-8")
    return re.findall(r"```(?:console|text)\n(.*?)```", page, re.DOTALL)


@pytest.mark.slow
def test_its_commands(run, root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    poses = re.search(r'POSES = "(.*)"', (root / "docs" / "stage1_pictures.py").read_text(encoding="utf-8"))
    assert poses is not None
    for name, text in (
        ("fence.urdf", URDF),
        ("robot.yaml", ROBOT),
        ("frequency_poses.csv", poses[1].replace("\\n", "\n")),
    ):
        Path(name).write_text(text)
    ran = []
    for console in consoles(root):
        for part in re.split(r"^\$ ", console, flags=re.MULTILINE)[1:]:
            command, *expected = part.splitlines()
            if command.startswith("flexcal measure"):
                Robot().play(Path("excitation"), before=1.0).write(Path("recordings"), by_hand=5)
            outcome = run(*shlex.split(command)[1:])
            assert outcome.status == 0, outcome.err
            for line in expected:
                assert line == "…" or line in outcome.out, (command, line)
            ran.append((command, outcome.out))
    command, out = ran[-1]
    page = (root / "docs" / "stage-1-on-your-own-robot.md").read_text(encoding="utf-8")
    found = re.search(r"found are ([\d.]+) ± ([\d.]+) and ([\d.]+) ± ([\d.]+) ", page)
    assert command.startswith("flexcal identify stiffness") and found is not None
    for joint, value, std in (("j1", found[1], found[2]), ("j2", found[3], found[4])):
        row = next(line for line in out.splitlines() if f"{joint}.drive.stiffness" in line)
        estimate, sigma = (float(cell) for cell in row.split("│")[2:4])
        assert estimate == pytest.approx(float(value), rel=1e-4) and sigma == pytest.approx(
            float(std), rel=0.02
        )


@pytest.mark.slow
def test_the_limit_that_the_default_plan_of_the_tx90l_passes(
    run, root: Path, examples: Path, tmp_path: Path
) -> None:
    folder = copied(examples / "tx90l", tmp_path / "tx90l")
    shutil.rmtree(folder / "excitation", ignore_errors=True)
    assert run("design", "frequency", folder / "robot.yaml", "--out", folder / "frequency.yaml").status == 0
    outcome = run("export", "excitation", folder / "frequency.yaml", "--out", folder / "excitation")
    (said,) = [text for text in consoles(root) if text.startswith("flexcal: ")]
    assert said.strip() in outcome.err
