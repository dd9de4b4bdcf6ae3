"""CONTRIBUTING.md says what is so: the rooms of the house, and examples that apply to the code as it is."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from inclined_arm import AXES, ORIGINS, write_urdf
from scipy.spatial.transform import Rotation

from flexcal import _kernels

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
    assert len(DIFFS) == len(TITLES) == 6


def ball(q: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Place (3,) of a ball on the last link of an arm whose axes are off by `errors` (6, 3), rad."""
    turn, place = Rotation.identity(), np.zeros(3)
    for error, axis, origin, angle in zip(errors, AXES, ORIGINS, q, strict=True):
        place = place + turn.apply(origin)
        turn = turn * Rotation.from_rotvec(error) * Rotation.from_rotvec(angle * axis)
    return place + turn.apply([0.05, 0.02, 0.1])


def seated(errors: np.ndarray, rng: np.random.Generator) -> list[str]:
    """Rows of postures in which the ball sits in three seats, to 20 µm."""
    rows = []
    for name, seat in (("near", [0.5, 0.2, 0.7]), ("far", [0.3, -0.4, 0.9]), ("high", [0.5, 0.1, 1.0])):
        found = 0
        while found < 18:
            q, goal = rng.uniform(-1.5, 1.5, 6), np.array(seat) + 2e-5 * rng.normal(size=3)
            for _ in range(12):
                missing = goal - ball(q, errors)
                if np.linalg.norm(missing) < 1e-9:
                    break
                slopes = np.column_stack(
                    [(ball(q + 1e-6 * e, errors) - goal + missing) / 1e-6 for e in np.eye(6)]
                )
                q = q + np.clip(np.linalg.pinv(slopes) @ missing, -0.3, 0.3)
            if np.linalg.norm(goal - ball(q, errors)) < 1e-9 and np.abs(q).max() < 2.8:
                rows.append(",".join([*map(repr, q.tolist()), name]))
                found += 1
    return rows


def test_the_kind_of_measurement_works_with_the_example_applied(root: Path, tmp_path: Path) -> None:
    """A ball in seats at unknown places, read, planned and calibrated by a copy of the package in which the diff is applied."""
    shutil.copytree(root / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    for module in Path(_kernels.__file__).parent.glob("_kernels*.*"):
        if module.suffix != ".pyi":
            shutil.copy(module, tmp_path / "src" / "flexcal")
    diff = DIFFS[TITLES.index("kind of measurement")]
    subprocess.run(["git", "apply", "-"], input=diff, cwd=tmp_path, check=True, text=True)
    write_urdf(tmp_path)
    seats = ", ".join(
        f"{name}: {{kind: seat, std: 2.0e-5, xyz: [0.5, 0.2, 0.7]}}" for name in ("near", "far", "high")
    )
    (tmp_path / "robot.yaml").write_text(
        f"robot: r.urdf\npoints: {{ball: {{frame: l6, xyz: [0.05, 0.02, 0.1]}}}}\nmeasurements: {{{seats}}}\n"
    )
    rng = np.random.default_rng(8)
    rows = seated(2e-3 * rng.normal(size=(6, 3)), rng)
    (tmp_path / "held.csv").write_text("\n".join(["q1,q2,q3,q4,q5,q6,touched", *rows]) + "\n")
    calls = [
        ["calibrate", "robot.yaml", "held.csv", "--terms", "kinematic", "--hold-out", "touched"],
        ["design", "poses", "robot.yaml", "--measure", "near", "--candidates", "200", "--count", "15"],
    ]
    script = (
        "import sys; sys.dont_write_bytecode = True; "
        "sys.meta_path[:] = [f for f in sys.meta_path if 'Redirecting' not in type(f).__name__]; "
        f"sys.path.insert(0, {str(tmp_path / 'src')!r}); from flexcal.cli.main import main; sys.exit(any([main(c) for c in {calls}]))"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    held_out = re.search(r"left out by touched, mean error ([\d.]+) mm", done.stdout)
    assert held_out is not None and float(held_out[1]) < 0.08
    assert "from the readings of near" in done.stdout
