"""Every bad input that people bring: one clear sentence, exit status 2, and no file changed or left behind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from cli_files import read_csv, snapshot, write_csv
from refusals import assert_refusal

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
    ("gravity: [0, 0, -9.81]", "gravty: [0, 0, -9.81]", ["E-YAML-001", "robot.yaml line LINE", "gravty", "gravity"]),
    ("damping: 115.1}", "dampening: 115.1}", ["E-YAML-001", "robot.yaml line LINE", "dampening", "damping"]),
    ("stiffness: 143.7e3,", "stiffness: 0,", ["E-ROBOT-012", "robot.yaml line LINE"]),
    ("stiffness: 143.7e3,", "stiffness: -143.7e3,", ["E-ROBOT-012", "robot.yaml line LINE"]),
    ("stiffness: 143.7e3,", "stiffness: '143.7e3',", ["E-YAML-025", "robot.yaml line LINE", "143.7e3"]),
    ("frame: flange, xyz: [0.10, 0.00, 0.15]", "frame: flang, xyz: [0.1, 0, 0.1]", ["E-ROBOT-028", "flang", "flange"]),
    ("frame: flange, xyz: [0.10, 0.00, 0.15]", "frame: link_1, xyz: [0.1, 0, 0.1]", ["E-ROBOT-026", "joint_2"]),
    ("backlash: [joint_2, joint_3]", "backlash: [joint_2, joint_9]", ["E-ROBOT-027", "robot.yaml line", "joint_9", "joint_3"]),
    ("robot: tx90l.urdf", "robot: tx90.urdf", ["E-URDF-021", "tx90.urdf"]),
    ("rotor_inertia: [6.4, 9.8,", "rotor_inertia: [9.8,", ["E-ROBOT-036", "robot.yaml line", "rotor_inertia", "6"]),
    ("mass: 6.0, com", "mass: 0.0, com", ["E-ROBOT-008", "robot.yaml line LINE"]),
    ("gravity: [0, 0, -9.81]", "gravity: [0, 0, -9.81", ["E-YAML-004", "robot.yaml"]),
]  # fmt: skip


@pytest.mark.parametrize(("right", "wrong", "refusal"), ROBOT, ids=[wrong for _, wrong, _ in ROBOT])
def test_robot_yaml(run, tx90l_folder: Path, right: str, wrong: str, refusal: list[str]) -> None:
    robot = tx90l_folder / "robot.yaml"
    text = robot.read_text()
    assert right in text
    robot.write_text(text.replace(right, wrong, 1))
    sentence = refused_run(run, tx90l_folder, "design", "poses", robot, "--out", tx90l_folder / "plan.yaml")
    line = text[: text.index(right)].count("\n") + 1
    assert_refusal(sentence, *(name.replace("LINE", str(line)) for name in refusal))


def test_a_number_in_scientific_notation_is_a_number(tx90l_folder: Path) -> None:
    text = (tx90l_folder / "robot.yaml").read_text()
    assert "143.7e3" in text
    assert RobotModel.from_yaml(tx90l_folder / "robot.yaml").value("joint_1.drive.stiffness") == 143700.0


@pytest.mark.parametrize(
    ("content", "code"),
    [
        ("", "E-URDF-030"),
        ("<robot", "E-URDF-031"),
        ("<robot name='x'><link name='a'/><joint/></robot>", "E-URDF-008"),
        ("not XML at all", "E-URDF-030"),
    ],
)
def test_urdf_that_does_not_parse(run, ur5_folder: Path, content: str, code: str) -> None:
    (ur5_folder / "ur5.urdf").write_text(content)
    sentence = refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", ur5_folder / "grid.csv")
    assert_refusal(sentence, code, "ur5.urdf")


def test_measurements_that_count_twice(run, ur5_folder: Path) -> None:
    robot, poses = ur5_folder / "robot.yaml", ur5_folder / "random.csv"
    (ur5_folder / "copy.csv").write_bytes(poses.read_bytes())
    for verb in ("calibrate", "verify"):
        twice = refused_run(run, ur5_folder, verb, robot, poses, poses)
        assert_refusal(twice, "E-RUN-044", f"{poses} is given twice")
        assert_refusal(
            refused_run(run, ur5_folder, verb, robot, poses, ur5_folder / "copy.csv"),
            "E-RUN-044",
            "copy.csv",
            "holds the same as",
        )


def test_files_of_another_kind(run, tx90l_folder: Path) -> None:
    """Settings in the place of a plan, a file in that of a folder, a robot in that of responses."""
    robot, out = tx90l_folder / "robot.yaml", tx90l_folder / "out"
    sentence = refused_run(
        run, tx90l_folder, "measure", tx90l_folder / "cell.yaml", "--cell", "virtual", "--out", out
    )
    assert_refusal(sentence, "E-PLAN-021")
    assert_refusal(
        refused_run(run, tx90l_folder, "report", tx90l_folder / "tx90l.urdf"), "E-CLI-037", "tx90l.urdf"
    )
    sentence = refused_run(run, tx90l_folder, "identify", "stiffness", robot, tx90l_folder / "tx90l.urdf")
    assert "pickle" not in sentence
    assert_refusal(sentence, "E-FILE-003", "identify response")


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
    "missing column": (without("y"), ["E-TABLE-006", "y"]),
    "extra column": (lambda t: ([*t[0], "note"], np.hstack([t[1], t[1][:, :1]])), ["E-TABLE-004", "note"]),
    "misspelt column": (lambda t: ([c.replace("q6", "Q6") for c in t[0]], t[1]), ["E-TABLE-007", "q1…q5"]),
    "NaN": (with_value(4, "x", np.nan), ["E-TABLE-036", "6", "x"]),
    "infinite": (with_value(4, "q2", np.inf), ["E-TABLE-036", "6", "q2"]),
    "degrees": (scaled(JOINTS, 180 / np.pi), ["E-TABLE-001", "rad", "degrees"]),
    "five joints": (without("q6"), ["E-TABLE-007", "5", "6"]),
    "seven joints": (lambda t: ([*t[0], "q7"], np.hstack([t[1], t[1][:, 1:2]])), ["E-TABLE-007", "7", "6"]),
    "millimetres": (scaled("x y z", 1000), ["E-POSES-007", "millimetres"]),
    "too few poses": (kept(2), ["E-CAL-015", "2 poses"]),
    "one pose": (kept(1), ["E-POSES-003"]),
    "no poses": (kept(0), ["E-TABLE-019"]),
    "all poses equal": (still(JOINTS), ["E-POSES-004"]),
    "a joint that never moves": (still("q4"), ["E-POSES-005", "never moves", "wrist_1_joint"]),
}  # fmt: skip


@pytest.mark.parametrize(("alter", "refusal"), POSES.values(), ids=POSES.keys())
def test_pose_file(run, ur5_folder: Path, alter: Callable[[Table], Table], refusal: list[str]) -> None:
    header, rows = read_csv(ur5_folder / "grid.csv")
    file = write_csv(ur5_folder / "bad.csv", *alter((header, rows[:60])))
    sentence = refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", file, "--json")
    assert_refusal(sentence, *refusal)
    assert "bad.csv" in sentence or refusal[0] == "E-CAL-015"  # an error of the fit


def test_poses_with_a_payload_that_robot_yaml_does_not_declare(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "random.csv")
    file = write_csv(
        ur5_folder / "held.csv", [*header, "payload"], np.hstack([rows, np.ones((len(rows), 1))])
    )
    assert_refusal(
        refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", file), "E-POSES-009", "payload"
    )


def test_draw_wire_lengths_are_refused_by_name(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "random.csv")
    file = write_csv(ur5_folder / "wire.csv", [*header[:7], "length"], rows[:, :8] ** 2 + 0.1)
    rows[:, 7] = 1.0
    assert_refusal(
        refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", file), "E-POSES-059", "wire"
    )


def test_orientations_that_are_not_the_robots_are_refused(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "random.csv")
    quaternion = np.random.default_rng(0).normal(size=(len(rows), 4))
    turned = np.hstack([rows, quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)])
    file = write_csv(ur5_folder / "turned.csv", [*header, "qw", "qx", "qy", "qz"], turned)
    sentence = refused_run(run, ur5_folder, "calibrate", ur5_folder / "robot.yaml", file)
    assert_refusal(sentence, "E-CAL-012", "flexcal import")


def test_calibrate_from_a_station_that_robot_yaml_does_not_have(run, ur5_folder: Path) -> None:
    lines = (ur5_folder / "random.csv").read_text().splitlines()
    moved = [f"{lines[0]},station", *(f"{line},elsewhere" for line in lines[1:])]
    (ur5_folder / "moved.csv").write_text("\n".join(moved) + "\n")
    arguments = (ur5_folder / "robot.yaml", ur5_folder / "moved.csv")
    assert_refusal(refused_run(run, ur5_folder, "calibrate", *arguments), "E-ROBOT-042", "elsewhere")


def test_sigma_in_some_files_only(run, ur5_folder: Path) -> None:
    header, rows = read_csv(ur5_folder / "random.csv")
    stated = np.hstack([rows, np.full((len(rows), 1), 5e-5)])
    file = write_csv(ur5_folder / "stated.csv", [*header, "sigma"], stated)
    arguments = (ur5_folder / "robot.yaml", ur5_folder / "random.csv", file)
    assert_refusal(refused_run(run, ur5_folder, "calibrate", *arguments), "E-POSES-025", "1", "2")


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
    assert_refusal(sentence, "E-CAL-010", "joint_2")


def test_unknown_term(run, ur5_folder: Path) -> None:
    arguments = (ur5_folder / "robot.yaml", ur5_folder / "random.csv", "--terms", "kinematics")
    assert_refusal(refused_run(run, ur5_folder, "calibrate", *arguments), "E-RUN-011", "kinematics")


@pytest.mark.parametrize(
    ("verb", "option", "value"),
    [
        (("design", "poses"), "--count", "0"),
        (("design", "poses"), "--seed", "-1"),
        (("design", "poses"), "--candidates", "-5"),
        (("design", "poses"), "--payload", "nan"),
        (("design", "frequency"), "--seed", "-1"),
        (("map",), "--count", "1000000000000"),
        (("map",), "--count", 400 * "9"),
        (("design", "poses"), "--count", "100000000"),
        (("design", "trajectory"), "--duration", "1e300"),
    ],
)
def test_numbers_out_of_range(
    run, tx90l_folder: Path, verb: tuple[str, ...], option: str, value: str
) -> None:
    robot, out = tx90l_folder / "robot.yaml", tx90l_folder / "out.yaml"
    sentence = refused_run(run, tx90l_folder, *verb, robot, "--out", out, option, value)
    assert_refusal(sentence, "E-CLI-008", option)


def test_negative_secant_scale(run, ur5_folder: Path) -> None:
    arguments = (ur5_folder / "robot.yaml", ur5_folder / "random.csv", "--secant-scale", "-0.1")
    assert_refusal(refused_run(run, ur5_folder, "calibrate", *arguments), "E-CLI-008", "--secant-scale")


# ---- arguments in each other's place ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("verb", ["calibrate", "verify", "identify stiffness"])
def test_swapped_arguments(run, ur5_folder: Path, verb: str) -> None:
    sentence = refused_run(run, ur5_folder, *verb.split(), ur5_folder / "grid.csv", ur5_folder / "robot.yaml")
    assert len(sentence) < 400
    assert_refusal(sentence, "E-CLI-005", "robot.yaml")


def test_folder_in_the_place_of_the_robot(run, ur5_folder: Path) -> None:
    sentence = refused_run(run, ur5_folder, "identify", "response", ur5_folder, ur5_folder / "robot.yaml")
    assert_refusal(sentence, "E-CLI-005")
    assert_refusal(
        refused_run(run, ur5_folder, "calibrate", ur5_folder / "ur5.urdf", ur5_folder / "grid.csv"),
        "E-CLI-006",
    )


def test_a_whole_file_is_not_quoted(run, ur5_folder: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    robot.write_bytes((ur5_folder / "grid.csv").read_bytes())
    sentence = refused_run(run, ur5_folder, "calibrate", robot, ur5_folder / "grid.csv")
    assert len(sentence) < 400
    assert_refusal(sentence, "E-YAML-023", "robot.yaml line 1")


# ---- order of work ----------------------------------------------------------------------------------------------------------------


def test_verify_before_calibrate(run, ur5_folder: Path) -> None:
    sentence = refused_run(run, ur5_folder, "verify", ur5_folder / "robot.yaml", ur5_folder / "random.csv")
    assert_refusal(sentence, "E-RUN-055", "estimates.yaml", "flexcal calibrate")


@pytest.mark.parametrize(
    ("verb", "named", "refusal"),
    [
        (("verify", "random.csv"), "random.csv", ["E-RUN-053", "random.csv", "estimates.yaml"]),
        (("verify", "random.csv"), "estimates.npz", ["E-RUN-053", "estimates.npz", "estimates.yaml"]),
        (
            ("compensate", "random.csv", "--out", "commands.csv"),
            "robot.yaml",
            ["E-RUN-054", "robot.yaml"],
        ),
        (("export", "urdf", "--out", "new.urdf"), "ur5.urdf", ["E-RUN-053", "ur5.urdf", "estimates.yaml"]),
        (("map", "--out", "map.html"), "empty", ["E-RUN-052", "empty", "estimates.yaml"]),
        (("repeatability", "random.csv"), "random.csv", ["E-RUN-053", "random.csv", "estimates.yaml"]),
    ],
)
def test_estimates_that_are_another_file(
    run,
    ur5_folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    verb: tuple[str, ...],
    named: str,
    refusal: list[str],
) -> None:
    monkeypatch.chdir(ur5_folder)
    Path("empty").mkdir()
    if verb[0] == "repeatability":  # it needs a pose twice before it looks for estimates
        lines = Path("random.csv").read_text().splitlines()
        Path("random.csv").write_text("\n".join([*lines, lines[1]]) + "\n")
    at = 2 if verb[0] == "export" else 1
    sentence = refused_run(run, ur5_folder, *verb[:at], "robot.yaml", *verb[at:], "--estimates", named)
    assert_refusal(sentence, *refusal)


def test_verify_from_a_station_that_was_not_calibrated(run, ur5_folder: Path) -> None:
    robot = ur5_folder / "robot.yaml"
    assert run("calibrate", robot, ur5_folder / "grid.csv", "--terms", "kinematic").status == 0
    lines = (ur5_folder / "random.csv").read_text().splitlines()
    moved = ["station", *["elsewhere"] * (len(lines) - 1)]
    (ur5_folder / "moved.csv").write_text(
        "\n".join(f"{a},{b}" for a, b in zip(lines, moved, strict=True)) + "\n"
    )
    assert_refusal(
        refused_run(run, ur5_folder, "verify", robot, ur5_folder / "moved.csv"), "E-RUN-008", "elsewhere"
    )


def test_estimates_of_another_robot(run, ur5_folder: Path, tx90l_folder: Path) -> None:
    assert (
        run("calibrate", ur5_folder / "robot.yaml", ur5_folder / "grid.csv", "--terms", "kinematic").status
        == 0
    )
    for name in ("estimates.yaml", "estimates.npz"):
        (tx90l_folder / name).write_bytes((ur5_folder / name).read_bytes())
    arguments = ("export", "urdf", tx90l_folder / "robot.yaml", "--out", tx90l_folder / "new.urdf")
    sentence = refused_run(run, tx90l_folder, *arguments)
    assert_refusal(sentence, "E-ROBOT-045", "estimates.yaml", "shoulder_pan_joint")


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
    assert_refusal(refused_run(run, ur5_folder, "calibrate", *arguments), "E-CLI-011")


def test_nominal_urdf_is_never_overwritten(run, ur5_folder: Path) -> None:
    arguments = (ur5_folder / "robot.yaml", "--out", ur5_folder / "ur5.urdf")
    assert_refusal(refused_run(run, ur5_folder, "export", "urdf", *arguments), "E-CLI-013")
