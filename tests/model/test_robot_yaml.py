"""robot.yaml with a mistake: one sentence with the line of the mistake, what is wrong and what to do."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from flexcal.errors import InputError
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
    (GRAVITY, "gravty: [0, 0, -9.81]", ["unknown key 'gravty'", "did you mean 'gravity'?"]),
    (GRAVITY, f"{GRAVITY}\nspeed: 3", ["unknown key 'speed'", "known are robot, points"]),
    (SPRING, "drive: {stiffness: 143.7e3, dampening: 1}", ["unknown key 'dampening'", "'damping'"]),
    (SPRING, "drive: {damping: 115.1}", ["'stiffness'", "missing"]),
    (SPRING, SPRING + "\n    drive: {stiffness: 1}", ["'drive'", "keep one"]),
    (GRAVITY, f"{GRAVITY}\nbearings: parent", ["bearings", "'before'", "'after'", "'parent'"]),
    # numbers
    (SPRING, "drive: {stiffness: '143.7e3', damping: 1}", ["a number is expected", "'143.7e3'"]),
    (SPRING, "drive: {stiffness: stiff, damping: 1}", ["a number is expected", "'stiff'"]),
    (SPRING, "drive: {stiffness: .nan, damping: 1}", ["a finite number is expected", "nan"]),
    (SPRING, "drive: {stiffness: .inf, damping: 1}", ["a finite number is expected", "inf"]),
    (SPRING, "drive: {stiffness: 0, damping: 1}", ["stiffness must be positive", "0 N m/rad"]),
    (SPRING, "drive: {stiffness: -5e3, damping: 1}", ["stiffness must be positive", "-5000 N m/rad"]),
    (SPRING, "drive: {stiffness: 5e3, damping: -1}", ["damping must not be negative", "-1 N m s/rad"]),
    (INERTIA, "rotor_inertia: [6.4, 9.8, .nan, 0.53, 0.11, 0.087]", ["rotor_inertia", "finite"]),
    (INERTIA, "rotor_inertia: [6.4, 9.8, -1.49, 0.53, 0.11, 0.087]", ["rotor_inertia must not be negative", "-1.49"]),
    (RATIO, "ratio: [45, 45, 0, 60, 60, 45]", ["ratio of 0"]),
    (PRIOR, "prior: {mass: -0.07}", ["mass, com and torque_constant must not be negative"]),
    (PRIOR, "prior: {rotor_inertia: 0}", ["rotor_inertia must be positive"]),
    (PAYLOAD, PAYLOAD.replace("6.0", "-6"), ["mass and mass_std must not be negative"]),
    # lengths
    (INERTIA, "rotor_inertia: [6.4, 9.8]", ["rotor_inertia has 2 entries", "6 joints", "one per joint"]),
    (RATIO, "ratio: [45, 45, 60, 60, 60, 45, 45]", ["ratio has 7 entries", "6 joints"]),
    (LOOP, LOOP.replace("3000, 3000, 800", "3000, 800"), ["kp has 5 entries", "6 joints"]),
    (LOOP, LOOP.replace("20, 8, 4]", "20, 8, 4, 1]"), ["kd has 7 entries", "6 joints"]),
    (LOOP, LOOP.replace("4000", "0"), ["rate_hz must be positive"]),
    (LOOP, LOOP.replace("400, 400,", "400, -400,"), ["kp and kd must not be negative"]),
    (GRAVITY, "gravity: [0, -9.81]", ["gravity", "3 items are expected, not 2"]),
    (POINT, "smr: {frame: flange, xyz: [0.10, 0.15]}", ["xyz", "3 items are expected, not 2"]),
    # names
    (POINT, "smr: {frame: flansh, xyz: [0.10, 0.00, 0.15]}", ["lacks the frame 'flansh'", "did you mean 'flange'?"]),
    (TERMS, "geometry: {backlash: [joint_7]}", ["no movable joint 'joint_7'", "joint_6"]),
    (TERMS, "geometry: {terms: [kinematik]}", ["unknown geometry term 'kinematik'"]),
    (RATIO, "coupling: [{motor: joint_6, joint: joint_7, ratio: 1}]", ["no movable joint 'joint_7'"]),
    (RATIO, "coupling: [{motor: motor_6, joint: joint_5, ratio: 1}]", ["no movable joint 'motor_6'"]),
    (RATIO, "coupling: [{motor: joint_5, joint: joint_5, ratio: 1}]", ["two different joints"]),
    (RATIO, "coupling: [{motor: joint_6, joint: joint_5, ratio: 0}]", ["other than 0"]),
    (TERMS, "dynamics: {friction: coulomb}", ["'auto', 'classic' or a list", "'coulomb'"]),
    (TERMS, "dynamics: {cutoff_hz: -1}", ["cutoff_hz must be positive"]),
    (TERMS, "dynamics: {decimation: 0}", ["decimation must be 1 or more"]),
    (TERMS, "dynamics: {decimation: 1.5}", ["decimation", "a whole number", "1.5"]),
    (ENTRY + BEARING, ENTRY, ["'joint_1' has one bearing spring", "bearing_x and bearing_y or neither"]),
]  # fmt: skip


@pytest.mark.parametrize(("right", "wrong", "words"), MISTAKES, ids=[wrong for _, wrong, _ in MISTAKES])
def test_one_sentence_with_the_line(folder: Path, right: str, wrong: str, words: list[str]) -> None:
    robot = folder / "robot.yaml"
    text = robot.read_text()
    assert text.count(right) == 1
    robot.write_text(text.replace(right, wrong))
    with pytest.raises(InputError) as caught:
        RobotModel.from_yaml(robot)
    sentence = str(caught.value)
    first = text[: text.index(right)].count("\n") + 1
    lines = range(first, first + 1 + wrong.count("\n"))
    assert any(sentence.startswith(f"{robot} line {line}: ") for line in lines), sentence
    assert "\n" not in sentence and sentence.endswith((".", "?"))
    for word in words:
        assert word in sentence, sentence


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
