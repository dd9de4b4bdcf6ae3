"""Every bad input that people bring: one clear sentence, exit status 2, and no file changed or left behind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from cli_files import read_csv, snapshot, write_csv

from flexcal.data.poses import PoseSet, write_poses
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.model.statics import gravity_torque

Table = tuple[list[str], np.ndarray]


def refused_run(run, folder: Path, *arguments: str | Path) -> str:
    """The one sentence with which a command line is refused; checks that nothing else happened."""
    before = snapshot(folder)
    outcome = run(*arguments)
    assert outcome.status == 2, f"exit {outcome.status}\n{outcome.out}\n{outcome.err}"
    assert outcome.out == ""
    assert snapshot(folder) == before
    sentences = [line for line in outcome.err.splitlines() if line.startswith("flexcal: ")]
    others = [line for line in outcome.err.splitlines() if not line.endswith(" …")]
    assert sentences == others and len(sentences) == 1
    assert "Traceback" not in outcome.err
    return sentences[0]


# ---- robot.yaml -------------------------------------------------------------------------------------------------------------------

ROBOT = [
    ("gravity: [0, 0, -9.81]", "gravty: [0, 0, -9.81]", ["robot.yaml line LINE:", "gravty", "gravity"]),
    ("damping: 115.1}", "dampening: 115.1}", ["robot.yaml line LINE", "dampening", "damping"]),
    ("stiffness: 143.7e3,", "stiffness: 0,", ["robot.yaml line LINE", "positive"]),
    ("stiffness: 143.7e3,", "stiffness: -143.7e3,", ["robot.yaml line LINE", "positive"]),
    ("stiffness: 143.7e3,", "stiffness: '143.7e3',", ["robot.yaml line LINE", "143.7e3"]),
    ("frame: flange, xyz: [0.10, 0.00, 0.15]", "frame: flang, xyz: [0.1, 0, 0.1]", ["lacks the frame 'flang'", "flange"]),
    ("frame: flange, xyz: [0.10, 0.00, 0.15]", "frame: link_1, xyz: [0.1, 0, 0.1]", ["downstream", "joint_2"]),
    ("backlash: [joint_2, joint_3]", "backlash: [joint_2, joint_9]", ["robot.yaml line", "joint_9", "joint_3"]),
    ("robot: tx90l.urdf", "robot: tx90.urdf", ["tx90.urdf"]),
    ("rotor_inertia: [6.4, 9.8,", "rotor_inertia: [9.8,", ["robot.yaml line", "rotor_inertia", "6 joints"]),
    ("mass: 6.0, com", "mass: 0.0, com", ["robot.yaml line LINE", "0 kg", "mass_std"]),
    ("gravity: [0, 0, -9.81]", "gravity: [0, 0, -9.81", ["robot.yaml line", "YAML"]),
]  # fmt: skip


@pytest.mark.parametrize(("right", "wrong", "words"), ROBOT, ids=[wrong for _, wrong, _ in ROBOT])
def test_robot_yaml(run, tx90l_folder: Path, right: str, wrong: str, words: list[str]) -> None:
    robot = tx90l_folder / "robot.yaml"
    text = robot.read_text()
    assert right in text
    robot.write_text(text.replace(right, wrong, 1))
    sentence = refused_run(run, tx90l_folder, "design", "poses", robot, "--out", tx90l_folder / "plan.yaml")
    line = text[: text.index(right)].count("\n") + 1
    for word in words:
        assert word.replace("LINE", str(line)) in sentence


def test_a_number_in_scientific_notation_is_a_number(tx90l_folder: Path) -> None:
    text = (tx90l_folder / "robot.yaml").read_text()
    assert "143.7e3" in text
    assert RobotModel.from_yaml(tx90l_folder / "robot.yaml").value("joint_1.drive.stiffness") == 143700.0


@pytest.mark.parametrize(
    "content", ["", "<robot", "<robot name='x'><link name='a'/><joint/></robot>", "not XML at all"]
)
def test_urdf_that_does_not_parse(run, ur5_folder: Path, content: str) -> None:
    (ur5_folder / "ur5.urdf").write_text(content)
    sentence = refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", ur5_folder / "grid.csv")
    assert "ur5.urdf" in sentence


def test_measurements_that_count_twice(run, ur5_folder: Path) -> None:
    robot, poses = ur5_folder / "robot.yaml", ur5_folder / "random.csv"
    (ur5_folder / "copy.csv").write_bytes(poses.read_bytes())
    for verb in ("calibrate", "verify"):
        assert f"{poses} is given twice" in refused_run(run, ur5_folder, verb, robot, poses, poses)
        assert "copy.csv holds the same as" in refused_run(
            run, ur5_folder, verb, robot, poses, ur5_folder / "copy.csv"
        )


def test_files_of_another_kind(run, tx90l_folder: Path) -> None:
    """Settings in the place of a plan, a file in that of a folder, a robot in that of responses."""
    robot, out = tx90l_folder / "robot.yaml", tx90l_folder / "out"
    sentence = refused_run(
        run, tx90l_folder, "measure", tx90l_folder / "cell.yaml", "--cell", "virtual", "--out", out
    )
    assert "this is no plan" in sentence and "flexcal design" in sentence
    assert "tx90l.urdf is no folder" in refused_run(run, tx90l_folder, "report", tx90l_folder / "tx90l.urdf")
    sentence = refused_run(run, tx90l_folder, "identify", "stiffness", robot, tx90l_folder / "tx90l.urdf")
    assert "identify response" in sentence and "pickle" not in sentence


# ---- pose files -------------------------------------------------------------------------------------------------------------------


def without(column: str) -> Callable[[Table], Table]:
    def alter(table: Table) -> Table:
        header, rows = table
        at = header.index(column)
        return header[:at] + header[at + 1 :], np.delete(rows, at, axis=1)

    return alter


def scaled(columns: str, factor: float) -> Callable[[Table], Table]:
    def alter(table: Table) -> Table:
        header, rows = table
        rows[:, [header.index(c) for c in columns.split()]] *= factor
        return header, rows

    return alter


def with_value(row: int, column: str, value: float) -> Callable[[Table], Table]:
    def alter(table: Table) -> Table:
        header, rows = table
        rows[row, header.index(column)] = value
        return header, rows

    return alter


def kept(count: int) -> Callable[[Table], Table]:
    return lambda table: (table[0], table[1][:count])


def still(columns: str) -> Callable[[Table], Table]:
    def alter(table: Table) -> Table:
        header, rows = table
        at = [header.index(c) for c in columns.split()]
        rows[:, at] = rows[0, at]
        return header, rows

    return alter


JOINTS = "q1 q2 q3 q4 q5 q6"
POSES = {
    "missing column": (without("y"), ["'y'", "missing"]),
    "extra column": (lambda t: ([*t[0], "note"], np.hstack([t[1], t[1][:, :1]])), ["'note'", "not known"]),
    "misspelt column": (lambda t: ([c.replace("q6", "Q6") for c in t[0]], t[1]), ["q"]),
    "NaN": (with_value(4, "x", np.nan), ["line 6, column x"]),
    "infinite": (with_value(4, "q2", np.inf), ["line 6, column q2"]),
    "degrees": (scaled(JOINTS, 180 / np.pi), ["degrees", "rad"]),
    "five joints": (without("q6"), ["5", "6 joints"]),
    "seven joints": (lambda t: ([*t[0], "q7"], np.hstack([t[1], t[1][:, 1:2]])), ["7", "6 joints"]),
    "millimetres": (scaled("x y z", 1000), ["millimetres"]),
    "too few poses": (kept(7), ["7 poses", "too few", "identifiable parameters", "at least"]),
    "one pose": (kept(1), ["one pose"]),
    "no poses": (kept(0), ["no rows"]),
    "all poses equal": (still(JOINTS), ["all poses are equal"]),
    "a joint that never moves": (still("q4"), ["wrist_1_joint", "never moves"]),
}  # fmt: skip


@pytest.mark.parametrize(("alter", "words"), POSES.values(), ids=POSES.keys())
def test_pose_file(run, ur5_folder: Path, alter: Callable[[Table], Table], words: list[str]) -> None:
    header, rows = read_csv(ur5_folder / "grid.csv")
    file = write_csv(ur5_folder / "bad.csv", *alter((header, rows[:60])))
    sentence = refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", file, "--json")
    for word in ["bad.csv", *words] if "parameters" not in " ".join(words) else words:
        assert word in sentence


def test_poses_with_a_payload_that_robot_yaml_does_not_declare(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "random.csv")
    file = write_csv(
        ur5_folder / "held.csv", [*header, "payload"], np.hstack([rows, np.ones((len(rows), 1))])
    )
    assert "payload" in refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", file)


def test_draw_wire_lengths_are_refused_by_name(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "random.csv")
    file = write_csv(ur5_folder / "wire.csv", [*header[:7], "length"], rows[:, :8] ** 2 + 0.1)
    rows[:, 7] = 1.0
    assert "wire" in refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", file)


def test_orientations_are_refused_by_name(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "random.csv")
    turned = np.hstack([rows, np.tile([1.0, 0.0, 0.0, 0.0], (len(rows), 1))])
    file = write_csv(ur5_folder / "turned.csv", [*header, "qw", "qx", "qy", "qz"], turned)
    sentence = refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", file)
    assert "turned.csv" in sentence and "take out the columns qw" in sentence


def test_calibrate_from_a_station_that_robot_yaml_does_not_have(run, ur5_folder: Path) -> None:
    lines = (ur5_folder / "random.csv").read_text().splitlines()
    moved = [f"{lines[0]},station", *(f"{line},elsewhere" for line in lines[1:])]
    (ur5_folder / "moved.csv").write_text("\n".join(moved) + "\n")
    arguments = (ur5_folder / "robot.yaml", ur5_folder / "moved.csv")
    assert "no station 'elsewhere'" in refused_run(run, ur5_folder, "calibrate", *arguments)


def test_sigma_in_some_files_only(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "random.csv")
    stated = np.hstack([rows, np.full((len(rows), 1), 5e-5)])
    file = write_csv(ur5_folder / "stated.csv", [*header, "sigma"], stated)
    arguments = (ur5_folder / "robot.yaml", ur5_folder / "random.csv", file)
    assert "only 1 of 2 pose sets have sigma" in refused_run(run, ur5_folder, "calibrate", *arguments)


def test_one_flank_of_a_backlash_only(run, tx90l_folder: Path, rng: np.random.Generator) -> None:
    model = RobotModel.from_yaml(tx90l_folder / "robot.yaml")
    q = rng.uniform(-1.2, 1.2, (400, model.n))
    torque = gravity_torque(model, q)
    q = q[(torque[:, 1] > 20) & (np.abs(torque[:, 2]) > 5)][:60]
    point = point_kinematics(model, q, jacobians=False).position
    poses = PoseSet(
        q=q, position=point, sigma=np.full((len(q), 3), 3e-5), torque=None, payload=None, temperature=None,
        target=np.full(len(q), "smr"), station=np.full(len(q), "tracker"), pose=np.arange(len(q)),
    )  # fmt: skip
    write_poses(tx90l_folder / "flank.csv", poses)
    sentence = refused_run(
        run, tx90l_folder, "calibrate", tx90l_folder / "robot.yaml", tx90l_folder / "flank.csv"
    )
    assert "joint_2" in sentence and "one flank" in sentence


def test_unknown_term(run, ur5_folder: Path) -> None:
    arguments = (ur5_folder / "robot.yaml", ur5_folder / "random.csv", "--terms", "kinematics")
    assert "'kinematics'" in refused_run(run, ur5_folder, "calibrate", *arguments)


@pytest.mark.parametrize(
    ("verb", "option", "value"),
    [
        (("design", "poses"), "--count", "0"),
        (("design", "poses"), "--seed", "-1"),
        (("design", "poses"), "--candidates", "-5"),
        (("design", "poses"), "--payload", "nan"),
        (("design", "frequency"), "--seed", "-1"),
    ],
)
def test_numbers_out_of_range(
    run, tx90l_folder: Path, verb: tuple[str, ...], option: str, value: str
) -> None:
    robot, out = tx90l_folder / "robot.yaml", tx90l_folder / "out.yaml"
    sentence = refused_run(run, tx90l_folder, *verb, robot, "--out", out, option, value)
    assert option in sentence and "at least" in sentence


def test_negative_secant_scale(run, ur5_folder: Path) -> None:
    arguments = (ur5_folder / "robot.yaml", ur5_folder / "random.csv", "--secant-scale", "-0.1")
    assert "--secant-scale" in refused_run(run, ur5_folder, "calibrate", *arguments)


# ---- arguments in each other's place ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("verb", ["calibrate", "verify", "identify stiffness"])
def test_swapped_arguments(run, ur5_folder: Path, verb: str) -> None:
    sentence = refused_run(run, ur5_folder, *verb.split(), ur5_folder / "grid.csv", ur5_folder / "robot.yaml")
    assert "did you mean" in sentence and "robot.yaml first" in sentence and len(sentence) < 400


def test_folder_in_the_place_of_the_robot(run, ur5_folder: Path) -> None:
    sentence = refused_run(run, ur5_folder, "identify", "response", ur5_folder, ur5_folder / "robot.yaml")
    assert "did you mean" in sentence
    assert "no robot.yaml" in refused_run(
        run, ur5_folder, "calibrate", ur5_folder / "ur5.urdf", ur5_folder / "grid.csv"
    )


def test_a_whole_file_is_not_quoted(run, ur5_folder: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    robot.write_bytes((ur5_folder / "grid.csv").read_bytes())
    sentence = refused_run(run, ur5_folder, "calibrate", robot, ur5_folder / "grid.csv")
    assert "robot.yaml line 1" in sentence and len(sentence) < 400


# ---- order of work ----------------------------------------------------------------------------------------------------------------


def test_verify_before_calibrate(run, ur5_folder: Path) -> None:
    sentence = refused_run(run, ur5_folder, "verify", ur5_folder / "robot.yaml", ur5_folder / "random.csv")
    assert "estimates.yaml" in sentence and "flexcal calibrate" in sentence


@pytest.mark.parametrize(
    ("verb", "named", "what"),
    [
        (("verify", "random.csv"), "random.csv", "random.csv is no estimates.yaml"),
        (("verify", "random.csv"), "estimates.npz", "estimates.npz is no estimates.yaml"),
        (
            ("compensate", "random.csv", "--out", "commands.csv"),
            "robot.yaml",
            "robot.yaml holds no estimates",
        ),
        (("export", "urdf", "--out", "new.urdf"), "ur5.urdf", "ur5.urdf is no estimates.yaml"),
        (("map", "--out", "map.html"), "empty", "empty holds no estimates.yaml"),
        (("repeatability", "random.csv"), "random.csv", "random.csv is no estimates.yaml"),
    ],
)
def test_estimates_that_are_another_file(
    run, ur5_folder: Path, monkeypatch: pytest.MonkeyPatch, verb: tuple[str, ...], named: str, what: str
) -> None:
    monkeypatch.chdir(ur5_folder)
    Path("empty").mkdir()
    if verb[0] == "repeatability":  # it needs a pose twice before it looks for estimates
        lines = Path("random.csv").read_text().splitlines()
        Path("random.csv").write_text("\n".join([*lines, lines[1]]) + "\n")
    at = 2 if verb[0] == "export" else 1
    sentence = refused_run(run, ur5_folder, *verb[:at], "robot.yaml", *verb[at:], "--estimates", named)
    assert what in sentence
    assert (
        "takes the estimates.yaml that 'flexcal calibrate' or another identification wrote, or the folder with it"
        in sentence
    )


def test_verify_from_a_station_that_was_not_calibrated(run, ur5_folder: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    assert run("calibrate", robot, ur5_folder / "grid.csv", "--terms", "kinematic").status == 0
    lines = (ur5_folder / "random.csv").read_text().splitlines()
    moved = ["station", *["elsewhere"] * (len(lines) - 1)]
    (ur5_folder / "moved.csv").write_text(
        "\n".join(f"{a},{b}" for a, b in zip(lines, moved, strict=True)) + "\n"
    )
    assert "'elsewhere'" in refused_run(run, ur5_folder, "verify", robot, ur5_folder / "moved.csv")


def test_estimates_of_another_robot(run, ur5_folder: Path, tx90l_folder: Path) -> None:
    assert (
        run("calibrate", ur5_folder / "robot.yaml", ur5_folder / "grid.csv", "--terms", "kinematic").status
        == 0
    )
    for name in ("estimates.yaml", "estimates.npz"):
        (tx90l_folder / name).write_bytes((ur5_folder / name).read_bytes())
    arguments = ("export", "urdf", tx90l_folder / "robot.yaml", "--out", tx90l_folder / "new.urdf")
    sentence = refused_run(run, tx90l_folder, *arguments)
    assert "estimates.yaml" in sentence and "shoulder_pan_joint" in sentence


def test_folder_that_cannot_be_written(run, ur5_folder: Path) -> None:
    (ur5_folder / "file").write_text("in the way")
    arguments = (
        ur5_folder / "robot.yaml",
        ur5_folder / "grid.csv",
        "--terms",
        "kinematic",
        "--out",
        ur5_folder / "file",
    )
    assert "cannot be written" in refused_run(run, ur5_folder, "calibrate", *arguments)


def test_nominal_urdf_is_never_overwritten(run, ur5_folder: Path) -> None:
    arguments = (ur5_folder / "robot.yaml", "--out", ur5_folder / "ur5.urdf")
    assert "never changed" in refused_run(run, ur5_folder, "export", "urdf", *arguments)
