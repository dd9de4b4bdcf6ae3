"""robot.yaml with a mistake: one sentence with the line of the mistake, what is wrong and what to do."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from refusals import refused

from flexcal.model.robot import RobotModel


@pytest.fixture
def folder(examples: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(examples / "tx90l", tmp_path / "tx90l"))


GRAVITY, PRIOR = "gravity: [0, 0, -9.81]", "prior: {mass: 0.07, com: 0.010, rotor_inertia: 0.05}"
SPRING, INERTIA = (
    "drive: {stiffness: 143.7e3, damping: 115.1}",
    "rotor_inertia: [6.4, 9.8, 1.49, 0.53, 0.11, 0.087]",
)
RATIO, ENTRY = "ratio: [45, 45, 60, 60, 60, 45]", f"- joint: joint_1\n    {SPRING}\n"
BEARING = "    bearing_x: {stiffness: 349.9e3, damping: 45.9}\n"
POINT, TERMS = (
    "smr: {frame: flange, xyz: [0.10, 0.00, 0.15]}",
    "geometry: {terms: auto, backlash: [joint_2, joint_3]}",
)
LOOP = "controller: {kp: [3000, 3000, 800, 300, 100, 60], kd: [400, 400, 100, 20, 8, 4], rate_hz: 4000}"
PAYLOAD = "payload: {frame: flange, mass: 6.0, com: [0.10, 0.00, -0.10], mass_std: 0.02}"

MISTAKES = [
    # unknown, missing and doubled keys
    (GRAVITY, "gravty: [0, 0, -9.81]", ["E-YAML-001", "gravty", "gravity"]),
    (GRAVITY, f"{GRAVITY}\nspeed: 3", ["E-YAML-001", "speed", "known are robot, serial, tolerance, points"]),
    (SPRING, "drive: {stiffness: 143.7e3, dampening: 1}", ["E-YAML-001", "dampening", "damping"]),
    (SPRING, "drive: {damping: 115.1}", ["E-YAML-002", "stiffness"]),
    (SPRING, SPRING + "\n    drive: {stiffness: 1}", ["E-YAML-014", "drive"]),
    (GRAVITY, f"{GRAVITY}\nbearings: parent", ["E-YAML-033", "bearings", "before", "after", "parent"]),
    # numbers
    (SPRING, "drive: {stiffness: '143.7e3', damping: 1}", ["E-YAML-025", "143.7e3"]),
    (SPRING, "drive: {stiffness: stiff, damping: 1}", ["E-YAML-025", "stiff"]),
    (SPRING, "drive: {stiffness: .nan, damping: 1}", ["E-YAML-026", "nan"]),
    (SPRING, "drive: {stiffness: .inf, damping: 1}", ["E-YAML-026", "inf"]),
    (SPRING, "drive: {stiffness: 0, damping: 1}", ["E-ROBOT-012", "0"]),
    (SPRING, "drive: {stiffness: -5e3, damping: 1}", ["E-ROBOT-012", "-5000"]),
    (SPRING, "drive: {stiffness: 5e3, damping: -1}", ["E-ROBOT-013", "-1"]),
    (INERTIA, "rotor_inertia: [6.4, 9.8, .nan, 0.53, 0.11, 0.087]", ["E-YAML-026", "rotor_inertia"]),
    (INERTIA, "rotor_inertia: [6.4, 9.8, -1.49, 0.53, 0.11, 0.087]", ["E-ROBOT-034", "rotor_inertia", "-1.49"]),
    (RATIO, "ratio: [45, 45, 0, 60, 60, 45]", ["E-ROBOT-035"]),
    (PRIOR, "prior: {mass: -0.07}", ["E-ROBOT-009"]),
    (PRIOR, "prior: {rotor_inertia: 0}", ["E-ROBOT-010", "rotor_inertia"]),
    (PAYLOAD, PAYLOAD.replace("6.0", "-6"), ["E-ROBOT-007"]),
    (POINT, "smr: {frame: flange, xyz: [100, 0, 150]}", ["E-ROBOT-083", "150 m", "millimetres"]),
    # lengths
    (INERTIA, "rotor_inertia: [6.4, 9.8]", ["E-ROBOT-036", "rotor_inertia", "2", "6"]),
    (RATIO, "ratio: [45, 45, 60, 60, 60, 45, 45]", ["E-ROBOT-036", "ratio", "7", "6"]),
    (LOOP, LOOP.replace("3000, 3000, 800", "3000, 800"), ["E-ROBOT-036", "kp", "5", "6"]),
    (LOOP, LOOP.replace("20, 8, 4]", "20, 8, 4, 1]"), ["E-ROBOT-036", "kd", "7", "6"]),
    (LOOP, LOOP.replace("4000", "0"), ["E-ROBOT-023"]),
    (LOOP, LOOP.replace("400, 400,", "400, -400,"), ["E-ROBOT-023"]),
    (GRAVITY, f"{GRAVITY}\ntolerance: 0.25", ["E-ROBOT-081", "0.25 m", "write 0.00025 for 0.25 mm"]),
    (GRAVITY, "gravity: [0, -9.81]", ["E-YAML-024", "gravity", "3", "2"]),
    (POINT, "smr: {frame: flange, xyz: [0.10, 0.15]}", ["E-YAML-024", "xyz", "3", "2"]),
    # names
    (POINT, "smr: {frame: flansh, xyz: [0.10, 0.00, 0.15]}", ["E-ROBOT-028", "flansh", "flange"]),
    (TERMS, "geometry: {backlash: [joint_7]}", ["E-ROBOT-027", "joint_7", "joint_6"]),
    (TERMS, "geometry: {terms: [kinematik]}", ["E-ROBOT-016", "kinematik"]),
    (RATIO, "coupling: [{motor: joint_6, joint: joint_7, ratio: 1}]", ["E-ROBOT-027", "joint_7"]),
    (RATIO, "coupling: [{motor: motor_6, joint: joint_5, ratio: 1}]", ["E-ROBOT-027", "motor_6"]),
    (RATIO, "coupling: [{motor: joint_5, joint: joint_5, ratio: 1}]", ["E-ROBOT-011"]),
    (RATIO, "coupling: [{motor: joint_6, joint: joint_5, ratio: 0}]", ["E-ROBOT-011"]),
    (TERMS, "dynamics: {friction: coulomb}", ["E-ROBOT-017", "coulomb"]),
    (TERMS, "dynamics: {cutoff_hz: -1}", ["E-ROBOT-018"]),
    (TERMS, "dynamics: {decimation: 0}", ["E-ROBOT-019"]),
    (TERMS, "dynamics: {decimation: 1.5}", ["E-YAML-033", "decimation", "a whole number", "1.5"]),
    (ENTRY + BEARING, ENTRY, ["E-ROBOT-014", "joint_1"]),
]  # fmt: skip


@pytest.mark.parametrize(("right", "wrong", "refusal"), MISTAKES, ids=[wrong for _, wrong, _ in MISTAKES])
def test_one_sentence_with_the_line(folder: Path, right: str, wrong: str, refusal: list[str]) -> None:
    robot = folder / "robot.yaml"
    text = robot.read_text()
    assert text.count(right) == 1
    robot.write_text(text.replace(right, wrong))
    with refused(*refusal) as caught:
        RobotModel.from_yaml(robot)
    sentence = str(caught.value)
    first = text[: text.index(right)].count("\n") + 1
    lines = range(first, first + 1 + wrong.count("\n"))
    assert any(sentence.startswith(f"{robot} line {line}: ") for line in lines), sentence
    assert "\n" not in sentence and sentence.endswith((".", "?"))


def test_numbers_of_yaml_1_2_are_numbers(folder: Path) -> None:
    robot = folder / "robot.yaml"
    robot.write_text(robot.read_text().replace(SPRING, "drive: {stiffness: 1437e2, damping: 1.151E+2}"))
    again = RobotModel.from_yaml(robot)
    assert again.value("joint_1.drive.stiffness") == 143.7e3
    assert again.value("joint_1.bearing_x.stiffness") == 349.9e3
    assert again.value("joint_1.drive.damping") == 115.1


def test_everything_that_formats_names_may_stand_in_it(folder: Path) -> None:
    robot = folder / "robot.yaml"
    coupling = "\n  coupling: [{motor: joint_6, joint: joint_5, ratio: -1.5}]"
    dynamics = (
        "\ndynamics: {friction: [coulomb, stribeck], cutoff_hz: 100, decimation: 10, mask_standstill: true}\n"
    )
    robot.write_text(robot.read_text().replace(RATIO, RATIO + coupling) + dynamics)
    config = RobotModel.from_yaml(robot).config
    assert config.drives.coupling[0].ratio == -1.5 and config.dynamics.decimation == 10
