"""Programs of a UR5 are corrected: its true kinematics, and an interpreter of its programs, in the maker's convention."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from program_cell import calibrate_cell
from six_axis_arm import registered

from flexcal.cli.main import main

_D = np.array([0.089159, 0.0, 0.0, 0.10915, 0.09465, 0.0823])
_A = np.array([0.0, -0.425, -0.39225, 0.0, 0.0, 0.0])
_ALPHA = np.array([np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0])
"""Denavit-Hartenberg parameters of the UR5 as its maker publishes them."""
_TOOL = np.array([0.0, 0.0, 0.031, 0.3, 0.0, 0.0])


def turned(vector: np.ndarray) -> np.ndarray:
    """Rotation of a rotation vector by Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def vector_of(turn: np.ndarray) -> np.ndarray:
    """Rotation vector of a rotation that is not one of half a turn."""
    angle = np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return axis / 2 if angle < 1e-9 else axis * angle / (2 * np.sin(angle))


def frame(pose: np.ndarray) -> np.ndarray:
    """Homogeneous matrix of a position and a rotation vector."""
    return np.block([[turned(pose[3:]), pose[:3, None]], [np.zeros((1, 3)), np.ones((1, 1))]])


class Ur5:
    """A UR5 by its Denavit-Hartenberg parameters, and its controller: inverse kinematics by Newton's method from where it stands."""

    def __init__(self, d: np.ndarray, a: np.ndarray, alpha: np.ndarray, zero: np.ndarray) -> None:
        self.d, self.a, self.alpha, self.zero = d, a, alpha, zero

    def tool(self, q: np.ndarray) -> np.ndarray:
        """Matrix of the tool in the base of the controller."""
        at = np.eye(4)
        for angle, d, a, alpha in zip(q + self.zero, self.d, self.a, self.alpha, strict=True):
            c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
            at = at @ np.array(
                [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
            )
        return at @ frame(_TOOL)

    def joints(self, pose: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Joint positions at a pose, from q."""
        goal = frame(pose)

        def off(q: np.ndarray) -> np.ndarray:
            at = self.tool(q)
            turn = goal[:3, :3] @ at[:3, :3].T
            axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
            return np.concatenate([goal[:3, 3] - at[:3, 3], axis])

        for _ in range(100):
            now = off(q)
            if np.abs(now).max() < 1e-12:
                break
            slope = np.array([(off(q + 1e-6 * e) - off(q - 1e-6 * e)) / 2e-6 for e in np.eye(6)]).T
            step = -np.linalg.solve(slope, now)
            q = q + step * min(1.0, 0.2 / np.abs(step).max())
        assert np.abs(off(q)).max() < 1e-9
        return q

    def along(self, pose: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Joint positions at a pose after a straight motion from q, in twenty steps."""
        first, last = self.tool(q), frame(pose)
        turn = vector_of(first[:3, :3].T @ last[:3, :3])
        for share in np.linspace(0, 1, 21)[1:]:
            at = first[:3, 3] + share * (last[:3, 3] - first[:3, 3])
            q = self.joints(np.concatenate([at, vector_of(first[:3, :3] @ turned(share * turn))]), q)
        return self.joints(pose, q)


NOMINAL = Ur5(_D, _A, _ALPHA, np.zeros(6))


def true_robot(seed: int) -> Ur5:
    """Errors of 0.3 mm and 0.5 mrad, but none in where the base stands, and none of the last joint, which would be the tool's as well."""
    rng = np.random.default_rng(seed)
    d, a, alpha, zero = (rng.normal(0, size, 6) for size in (3e-4, 3e-4, 5e-4, 5e-4))
    for error in (d, a, alpha, zero):
        error[5] = 0.0
    d[0] = zero[0] = 0.0
    return Ur5(_D + d, _A + a, _ALPHA + alpha, zero)


def moved(text: str, q: np.ndarray) -> list[np.ndarray]:
    """Joint positions of the motions of a program, run line by line: variables, movej, movel and get_inverse_kin with numbers."""
    known, stops = {}, []
    for line in text.replace("\r", "").splitlines():
        line = line.split("#")[0]
        for name, pose, numbers in re.findall(r"(\w+)\s*=\s*(p?)\[([^\]]*)\]", line):
            known[name] = (pose == "p", np.array([float(x) for x in numbers.split(",")]))
        if found := re.search(r"move[jl]\((?:get_inverse_kin\((\w+)|(p?)\[([^\]]*)\]|(\w+)[,)])", line):
            inner, pose, numbers, name = found.groups()
            if inner or name:
                if (inner or name) not in known:
                    continue
                is_pose, values = known[inner or name]
            else:
                is_pose, values = pose == "p", np.array([float(x) for x in numbers.split(",")])
            q = (
                values
                if not is_pose
                else NOMINAL.along(values, q)
                if "movel" in line
                else NOMINAL.joints(values, q)
            )
            stops.append(q)
    return stops


_PROGRAM = """def palletise():\r
  # made by hand in K\xf6ln: "brackets ( in comments" do not count
  set_tcp(p[0, 0, .031, 0.3, 0.0, 0.0])
  set_payload(0.0, [0.0, 0.0, 0.0])
  global home = [-0.4, -1.2, 1.9,-2.2, -1.5, 0.2]
  global above=p[{above}]
  movej(home, a=1.4, v=1.05)\t# first
  while (True):
    movej(get_inverse_kin(above, qnear=home), a=1.4, v=1.05)
{moves}    movel(pose_add(above, p[0, 0, 0.1, 0, 0, 0]), a=1.2, v=0.25)
    movel(camera_pose, v=0.1)
  end
end
"""


def written(pose: np.ndarray) -> str:
    """Position and rotation vector of a matrix, to ten decimals."""
    return ", ".join(f"{value:.10f}" for value in [*pose[:3, 3], *vector_of(pose[:3, :3])])


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, examples: Path) -> tuple[Path, Ur5]:
    """A calibrated UR5 and its program."""
    folder, arm = tmp_path_factory.mktemp("cell"), true_robot(3)
    shutil.copy(examples / "ur5_tracker" / "ur5.urdf", folder)
    (folder / "robot.yaml").write_text(
        "robot: ur5.urdf\npoints:\n  smr: {frame: tool0, xyz: [0, 0, 0.031]}\n", "utf-8"
    )
    rng, rows = np.random.default_rng(8), ["pose,q1,q2,q3,q4,q5,q6,x,y,z"]
    for k in range(80):
        q = np.array([0.0, -1.3, 1.8, -1.8, -1.5, 0.0]) + rng.uniform(-0.8, 0.8, 6)
        at = arm.tool(q)[:3, 3] + rng.normal(0, 1.5e-5, 3)
        rows.append(",".join([str(k), *map(repr, q.tolist()), *map(repr, at.tolist())]))
    (folder / "points.csv").write_text("\n".join(rows) + "\n", "utf-8")
    calibrate_cell(folder)
    stops = np.array([-0.1, -1.3, 2.0, -2.2, -1.5, 0.2]) + rng.uniform(-0.5, 0.5, (13, 6))
    above, *others = (written(NOMINAL.tool(q)) for q in stops)
    moves = "".join(f"    movel(p[{pose}], a=1.2, v=0.25, r=0.01)\n" for pose in others)
    program = _PROGRAM.format(above=above, moves=moves)
    (folder / "palletise.script").write_bytes(program.encode("latin-1"))
    return folder, arm


def filtered(folder: Path, source: str, out: str, *more: str) -> int:
    """Exit code of the verb."""
    options = ["--estimates", str(folder / "out"), "--out", str(folder / out), *more]
    return main(["filter", str(folder / "robot.yaml"), str(folder / source), *options])


def test_the_corrected_program_brings_the_true_tool_there(
    cell: tuple[Path, Ur5], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, arm = cell
    capsys.readouterr()
    assert filtered(folder, "palletise.script", "new.script", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    before, after = (
        (folder / name).read_bytes().decode("latin-1") for name in ("palletise.script", "new.script")
    )
    home = np.array([-0.4, -1.2, 1.9, -2.2, -1.5, 0.2])
    wanted, was, now = moved(before, home), moved(before, home), moved(after, home)
    assert len(wanted) == 14
    goals = np.array([NOMINAL.tool(q)[:3, 3] for q in wanted])
    errors = [registered(np.array([arm.tool(q)[:3, 3] for q in each]), goals) for each in (was, now)]
    assert errors[0].mean() > 2e-4 and errors[1].mean() < 2e-5
    number = r"-?\d*\.\d+|-?\d+"
    assert re.sub(number, "0", before) == re.sub(number, "0", after), "only numbers change"
    assert [item["line"] for item in found["left"]] == [22, 23]
    assert "camera_pose is not set" in found["left"][1]["reason"]
    for line in (3, 4, 22, 23):
        assert before.splitlines()[line - 1] == after.splitlines()[line - 1]


def test_reverse_returns_the_numbers(cell: tuple[Path, Ur5]) -> None:
    folder, _ = cell
    assert filtered(folder, "palletise.script", "there.script") == 0
    assert filtered(folder, "there.script", "back.script", "--reverse") == 0
    first, there, back = (
        np.array([float(x) for x in re.findall(r"-?\d*\.\d+", (folder / name).read_text("latin-1"))])
        for name in ("palletise.script", "there.script", "back.script")
    )
    assert np.abs(back - first).max() < 1e-6 < np.abs(there - first).max()


def test_lines_are_divided(cell: tuple[Path, Ur5]) -> None:
    folder, _ = cell
    assert filtered(folder, "palletise.script", "undivided.script") == 0
    assert filtered(folder, "palletise.script", "divided.script", "--subdivide", "0.02") == 0
    whole, divided = ((folder / f"{name}divided.script").read_bytes() for name in ("un", ""))
    lines = whole.splitlines()
    new = [line for line in divided.splitlines() if line not in lines]
    assert new and [line for line in divided.splitlines() if line not in new] == lines
    number = rb"-?\d+\.\d+"
    for line in new:
        assert re.fullmatch(
            rb"    movel\(p\[" + b", ".join([number] * 6) + rb"\], a=1.2, v=0.25, r=0.01\)", line
        ), line


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("movel(p[0.1, 0.2, 0.3, 0, 0, 0)\n", 2, "E-PROG-001"),
        ("movel(p[-0.4, 0.1, 0.3, 0, 3, 0])\n", 0, "--tool"),
        ("set_tcp(p[0,0,0,0,0,0])\nmovel(p[-0.4, 0.1, 0.3, 0, 3, 0])\n", 0, "--start"),
        (
            "set_tcp(p[0,0,0,0,0,0])\nmovej([0,-1,1,-1,1,0])\nmovel(p[-4, 0.1, 0.3, 0, 3, 0])\n",
            0,
            "out of reach",
        ),
        ("movej(get_inverse_kin())\n", 0, "when the program runs"),
        ("movej([d2r(),-1,1,-1,1,1e999])\nmovej()\nset_tcp()\n", 0, "when the program runs"),
        (
            "set_tcp(p[0,0,0,0,0,0])\nmovej([0,-1,1,-1,1,0])\na=p[-0.4,0.1,0.3,0,3,0]\nmovel(a)\nmovel(pose_add(a, b))\n",
            0,
            "from a as corrected",
        ),
        ("a=[0,-1,1,-1,1,0]\na=[0,-1,1,-1,1,1]\nmovej(a)\n", 0, "set more than once"),
        ("a=p[-0.4,0.1,0.3,0,3,0]\na[2]=0.1\nmovej(a)\n", 0, "set more than once"),
        ("def f(a):\n movej(a)\nend\na=[0,-1,1,-1,1,0]\n", 0, "set more than once"),
        (
            "a=p[-0.4,0.1,0.3,0,3,0]\nset_tcp(p[0,0,0,0,0,0])\nmovej([0,-1,1,-1,1,0])\nmovel(a)\nset_tcp(p[0,0,1,0,0,0])\nmovel(a)\n",
            0,
            "different tools",
        ),
    ],
)
def test_what_stays_is_said(
    cell: tuple[Path, Ur5],
    tmp_path: Path,
    text: str,
    code: int,
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder, _ = cell
    (folder / "odd.script").write_text(text, "utf-8")
    capsys.readouterr()
    assert filtered(folder, "odd.script", "odd_new.script") == code
    told = " ".join("".join(capsys.readouterr()).split())
    assert said in told


def test_nothing_is_said_to_be_corrected_that_stays(
    cell: tuple[Path, Ur5], capsys: pytest.CaptureFixture[str]
) -> None:
    """A target is computed from one that is out of reach."""
    folder, _ = cell
    text = "set_tcp(p[0,0,0,0,0,0])\nmovej([0,-1,1,-1,1,0])\na=p[-4, 0.1, 0.3, 0, 3, 0]\nmovel(a)\nmovel(pose_add(a, b))\n"
    (folder / "far.script").write_text(text, "utf-8")
    capsys.readouterr()
    assert filtered(folder, "far.script", "far_new.script") == 0
    told = capsys.readouterr().out
    assert "out of reach" in told and "when the program runs" in told and "as corrected" not in told


def test_the_printed_command_leads_back_with_the_same_options(
    cell: tuple[Path, Ur5],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The tool and the start of this run stand in it, and names with spaces are quoted."""
    folder, _ = cell
    monkeypatch.chdir(tmp_path)
    robot = tmp_path / "my robot"
    robot.mkdir()
    for file in folder.iterdir():
        if file.is_file() and file.suffix in (".yaml", ".urdf"):
            (robot / file.name).write_bytes(file.read_bytes())
    source = "movel(p[-0.4, 0.1, 0.3, 0, 3, 0])\n"
    Path("a b.script").write_text(source, "utf-8")
    estimates = next(path for path in folder.rglob("estimates.yaml"))
    given = ["--tool", "0", "0", "0.1", "0", "0", "0", "--start", "0", "-1", "1", "-1", "1", "0"]
    run = ["filter", str(robot / "robot.yaml"), "a b.script", "--estimates", str(estimates), *given]
    assert main([*run, "--out", "new.script"]) == 0
    back = capsys.readouterr().out.rpartition("the way back: ")[2].strip()
    words = shlex.split(back)
    assert words[:2] == ["flexcal", "filter"] and main(words[1:]) == 0, back
    assert "the way back" not in capsys.readouterr().out
    numbers = [float(x) for x in re.findall(r"-?\d+\.?\d*", Path("ORIGINAL.script").read_text("utf-8"))]
    np.testing.assert_allclose(numbers, [-0.4, 0.1, 0.3, 0, 3, 0], atol=1e-6)


def test_a_program_is_never_its_own_output(
    cell: tuple[Path, Ur5], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _ = cell
    source = tmp_path / "b.script"
    source.write_text("movej([0,-1,1,-1,1,0])\n", "utf-8")
    assert filtered(folder, str(source), str(tmp_path / "new.script")) == 0
    before = (tmp_path / "new.script").read_bytes()
    capsys.readouterr()
    assert filtered(folder, str(tmp_path / "new.script"), str(tmp_path / "new.script")) == 2
    assert "E-PROG-017" in capsys.readouterr().err
    assert (tmp_path / "new.script").read_bytes() == before


@pytest.mark.parametrize("text", ["", "milk\neggs\n"])
def test_what_is_no_program_is_refused(
    cell: tuple[Path, Ur5], tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _ = cell
    (tmp_path / "list.script").write_text(text, "utf-8")
    assert filtered(folder, str(tmp_path / "list.script"), str(tmp_path / "new.script")) == 2
    assert "E-PROG-016" in capsys.readouterr().err and not (tmp_path / "new.script").exists()


def test_a_guessed_configuration_is_told(cell: tuple[Path, Ur5], capsys: pytest.CaptureFixture[str]) -> None:
    folder, _ = cell
    text = (
        "set_tcp(p[0,0,0,0,0,0])\nmovej([0,-1,1,-1,1,0])\nmovej(somewhere)\nmovel(p[-0.4, 0.1, 0.3, 0, 3, 0])\n"
        "movel(p[-0.4, 0.12, 0.3, 0, 3, 0])\n"
    )
    (folder / "guess.script").write_text(text, "utf-8")
    capsys.readouterr()
    assert filtered(folder, "guess.script", "guess_new.script") == 0
    assert (
        "configuration is taken to be that of the last known one: line 4; check it there"
        in capsys.readouterr().out
    )
