"""CONTRIBUTING.md says what is so: the rooms of the house, and examples that apply to the code as it is."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

PAGE = (Path(__file__).parent.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
DIFFS = re.findall(r"^```diff\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
TITLES = re.findall(r"^## Add an? (.*)$", PAGE, flags=re.MULTILINE)


def test_the_house_has_every_room_on_its_floor(root: Path) -> None:
    with (root / "pyproject.toml").open("rb") as stream:
        floors = tomllib.load(stream)["tool"]["importlinter"]["contracts"][0]["layers"]
    picture = PAGE.split("```text\n")[1].split("```")[0]
    rooms = re.findall(r"^  (\w+)", picture, flags=re.MULTILINE)
    for floor in floors:
        expected = sorted(re.findall(r"\w+", floor))
        assert sorted(rooms[: len(expected)]) == expected
        rooms = rooms[len(expected) :]
    assert rooms == []


@pytest.mark.parametrize("diff", DIFFS, ids=TITLES)
def test_examples_apply_and_are_small(diff: str, root: Path) -> None:
    """Where one does not, make it anew: apply it by hand, run it as the page does, and put `git diff -U1` in its place."""
    files = re.findall(r"^\+\+\+ b/(.*)$", diff, flags=re.MULTILINE)
    assert 0 < len(files) <= 3 and not any(file.startswith("tests") for file in files)
    done = subprocess.run(
        ["git", "apply", "--check", "-"], input=diff, cwd=root, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_every_example_has_a_diff() -> None:
    assert len(DIFFS) == len(TITLES) == 5
