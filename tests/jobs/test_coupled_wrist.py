"""`identify dynamics --flexible` where one motor turns two elastic joints, on a robot simulated in MuJoCo and by Fourier series."""

from __future__ import annotations

from pathlib import Path

import pytest
from coupled_wrist import BEFORE, COULOMB, RATIO, ROTOR, write_coupled
from pushed_robot import SPRINGS, pushed_yaml
from refusals import refused

from flexcal.jobs.dynamics import identify_robot_dynamics
from flexcal.model.robot import RobotModel

ELASTIC = """elastic:
  - {joint: elbow, drive: {stiffness: 500}}
  - {joint: roll, drive: {stiffness: 500}}
"""
COUPLED = f"drives: {{coupling: [{{motor: roll, joint: elbow, ratio: {RATIO}}}]}}\n"


def wrist(folder: Path, extra: str, wrench: str = "") -> Path:
    robot = pushed_yaml(folder, extra=extra, wrench=wrench, dynamics=SPRINGS)
    text = robot.read_text().replace("cutoff_hz: 20, decimation: 5", "cutoff_hz: 100, decimation: 50")
    robot.write_text(text)
    return robot


@pytest.mark.parametrize("behind", [False, True])
def test_springs_before_and_behind_the_coupling(behind: bool, tmp_path: Path) -> None:
    """Before it the roll motor's spring twists both joints; behind it nothing of one is felt at the other."""
    robot = wrist(tmp_path, ELASTIC + COUPLED)
    log = write_coupled(tmp_path / "log.parquet", 3, behind=behind, noise=0.002)
    found = identify_robot_dynamics(robot, [log], flexible=True, estimator="sdp")
    parameters = found.document()["parameters"]
    stored = RobotModel.from_yaml(robot)
    assert stored.value("roll.drive.stiffness") == found.estimate.values["roll.drive.stiffness"]
    shared = 0.0 if behind else BEFORE["roll"]
    expected = {
        "elbow.drive.stiffness": BEFORE["elbow"] + RATIO**2 * shared,
        "roll.drive.stiffness": BEFORE["roll"],
        "roll.drive.stiffness_at_elbow": shared,
        "roll.rotor_inertia": ROTOR[1],
        "roll.rotor_inertia_at_elbow": ROTOR[1],
        "roll.coulomb_at_elbow": COULOMB[1],
    }
    for name, truth in expected.items():
        item = parameters[name]
        assert abs(item["estimate"] - truth) < 4 * item["std"] + 1e-4 * abs(truth), name
    assert parameters["roll.drive.stiffness_at_elbow"]["std"] < 1e-3 * BEFORE["roll"]


def test_a_wrench_acts_on_the_arm(tmp_path: Path) -> None:
    """Eq. 2.21: it stands beside the arm's torques, and the motors feel it through their springs alone."""
    robot = wrist(tmp_path, ELASTIC + COUPLED, "on_robot")
    log = write_coupled(tmp_path / "log.parquet", 3, noise=0.002, push=40.0)
    document = identify_robot_dynamics(robot, [log], flexible=True).document()
    for name in ("roll.drive.stiffness", "roll.drive.stiffness_at_elbow"):
        item = document["parameters"][name]
        assert abs(item["estimate"] - BEFORE["roll"]) < 4 * item["std"] + 1e-4 * BEFORE["roll"]
    share = document["external_share"]
    assert share["low"] - 1e-3 < 1.0 < share["high"] + 1e-3 and document["error_percent"]["train"] < 0.5
    assert max(document["error_percent"]["per_motor"].values()) < 0.5


def test_without_the_coupling_the_springs_are_wrong(tmp_path: Path) -> None:
    log = write_coupled(tmp_path / "log.parquet", 3, noise=0.002)
    found = identify_robot_dynamics(wrist(tmp_path, ELASTIC), [log], flexible=True).document()
    assert found["parameters"]["roll.drive.stiffness"]["estimate"] < 0.9 * BEFORE["roll"]
    assert found["error_percent"]["per_motor"]["roll"] > 5.0


@pytest.mark.parametrize(
    ("extra", "refusal"),
    [
        (
            ELASTIC.splitlines()[0] + "\n" + ELASTIC.splitlines()[1] + "\n" + COUPLED,
            ["E-RUN-025", "roll"],
        ),
        (ELASTIC + COUPLED + "geometry: {backlash: [roll]}\n", ["E-RUN-026", "roll"]),
    ],
)
def test_what_is_refused(extra: str, refusal: list[str], tmp_path: Path) -> None:
    log = write_coupled(tmp_path / "log.parquet", 3)
    with refused(*refusal):
        identify_robot_dynamics(wrist(tmp_path, extra), [log], flexible=True)
