"""The drives' springs from logs that have the arm side: the virtual TX90L, whose truth is known, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from over_seeds import over_seeds
from refusals import refused

from flexcal.cli.main import main
from flexcal.estimation import Estimate
from flexcal.jobs.dynamics import identify_robot_dynamics
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell import CellConfig, draw_truth

DRIVES = tuple(f"joint_{i}.drive" for i in (1, 2, 3))
SEED = 4
ZEROS = (5e-3, 3e-3, -2e-3)
"""rad"""


def drawn(tx90l: RobotModel, seed: int) -> dict[str, float]:
    return draw_truth(tx90l, CellConfig().spread, np.random.default_rng([seed, 0]))


@pytest.fixture(scope="module")
def truth(tx90l: RobotModel) -> dict[str, float]:
    return drawn(tx90l, SEED)


@pytest.fixture(scope="module")
def recorded(arm_side_logs, truth, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Path]]:
    """The encoders on the arm side start elsewhere than those of the motors; calm motions, in which gaps weigh."""
    robot, logs = arm_side_logs(tmp_path_factory.mktemp("logs"), truth, SEED, 3, share=0.5)
    for log in logs:
        shifted = [pl.col(f"qa{i}") + zero for i, zero in enumerate(ZEROS, start=1)]
        pl.read_parquet(log).with_columns(shifted).write_parquet(log)
    return robot, logs


def stiffness(estimate: Estimate) -> np.ndarray:
    return np.array([estimate.values[f"{drive}.stiffness"] for drive in DRIVES])


def flexible(robot: Path, logs: list[Path]) -> Estimate:
    return identify_robot_dynamics(robot, logs, flexible=True).estimate


def test_drives_of_the_virtual_robot(recorded, truth: dict[str, float], tmp_path: Path) -> None:
    """Stiffness to a fraction of the 2 % that are asked for, whatever the encoders' zeros; gaps and dampings are there too.

    A robot can be built with the estimate.
    """
    robot, logs = recorded
    found = identify_robot_dynamics(robot, logs, flexible=True, estimator="sdp", out=tmp_path)
    values = found.estimate.values
    for drive, zero in zip(DRIVES, ZEROS, strict=True):
        true = truth[f"{drive}.stiffness"]
        std = found.estimate.std(f"{drive}.stiffness")
        assert std is not None and std < 0.005 * true
        assert abs(values[f"{drive}.stiffness"] - true) < 4 * std + 2e-4 * true
        damping, uncertainty = truth[f"{drive}.damping"], found.estimate.std(f"{drive}.damping")
        assert uncertainty is not None and uncertainty < 0.6 * damping
        assert abs(values[f"{drive}.damping"] - damping) < 4 * uncertainty
        assert values[f"{drive}.torque_offset"] == pytest.approx(zero * true, rel=5e-3)
        joint = drive.partition(".")[0]
        assert values[f"{joint}.rotor_inertia"] == pytest.approx(truth[f"{joint}.rotor_inertia"], rel=5e-3)
    for joint in ("joint_2", "joint_3"):
        gap = f"{joint}.drive.gap_torque"
        uncertainty = found.estimate.std(gap)
        assert uncertainty is not None and uncertainty < 0.05 * values[gap]
        half_gap = values[gap] / values[f"{joint}.drive.stiffness"]
        assert abs(half_gap / truth[f"{joint}.backlash"] - 1) < 4 * uncertainty / values[gap]
    percent = found.document()["error_percent"]
    assert set(percent["per_motor"]) == {f"joint_{i}" for i in (1, 2, 3)}
    assert max(percent["per_motor"].values()) < 2
    assert (tmp_path / "report.html").exists()
    identified = RobotModel.from_yaml(robot, estimates=False).with_estimate(found.estimate)
    assert identified.value("joint_1.drive.stiffness") == values["joint_1.drive.stiffness"]


def test_what_is_not_looked_for_shows_elsewhere(recorded, truth: dict[str, float]) -> None:
    """A gap makes a drive soft, the less the more torque it carries; half a sample of hold counts as damping, K T/2 with T = 1/4000 s."""
    robot, logs = recorded
    blind, late = robot.with_name("blind.yaml"), robot.with_name("late.yaml")
    blind.write_text(robot.read_text().replace("backlash: [joint_2, joint_3]", "backlash: []"))
    late.write_text(blind.read_text().replace("tau: held", "tau: instantaneous"))
    here, there = flexible(blind, logs), flexible(late, logs)
    ratio = stiffness(here) / [truth[f"{drive}.stiffness"] for drive in DRIVES]
    assert abs(ratio[0] - 1) < 1e-3
    assert max(ratio[1:]) < 0.99
    excess = there.values["joint_1.drive.damping"] - here.values["joint_1.drive.damping"]
    assert excess == pytest.approx(here.values["joint_1.drive.stiffness"] / 8000, rel=0.15)


def test_what_the_flexible_model_needs(recorded, tmp_path: Path) -> None:
    """One sentence each, and nothing is written."""
    robot, logs = recorded
    log = tmp_path / "motor.parquet"
    pl.read_parquet(logs[0]).drop([f"qa{i}" for i in range(1, 7)]).write_parquet(log)
    rigid, coupled = robot.with_name("rigid.yaml"), robot.with_name("coupled.yaml")
    text = robot.read_text()
    rigid.write_text(text[: text.index("elastic:")] + text[text.index("geometry:") :])
    rigid.write_text(rigid.read_text().replace("[joint_2, joint_3]", "[]"))
    coupled.write_text(
        text.replace(
            "  # assumed: no coupling", "  coupling: [{motor: joint_4, joint: joint_3, ratio: 1}]\n  #"
        )
    )
    for file, measured, names in (
        (robot, log, ["E-RUN-027", "motor.parquet", "qa1…qa6"]),
        (rigid, logs[0], ["E-RUN-024", "rigid.yaml"]),
        (coupled, logs[0], ["E-RUN-025", "joint_3", "joint_4"]),
    ):
        with refused(*names) as refusal:
            identify_robot_dynamics(file, [measured], flexible=True, out=tmp_path / "out")
        assert "\n" not in str(refusal.value)
    with refused("E-RUN-023", "energy", "wls"):
        identify_robot_dynamics(robot, logs, flexible=True, estimator="energy", out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_command_shows_the_drives(recorded, capsys: pytest.CaptureFixture[str]) -> None:
    robot, logs = recorded
    assert main(["identify", "dynamics", str(robot), *map(str, logs[:3]), "--flexible"]) == 0
    shown = capsys.readouterr().out
    assert "drives of the elastic joints" in shown and "joint_3.drive.damping" in shown


def of_one_robot(seed: int, root: Path, arm_side_logs: Callable, tx90l: RobotModel) -> np.ndarray:
    """Of its drives (2, 3): whether the interval of the stiffness holds the truth, and the relative error."""
    folder = root / str(seed)
    folder.mkdir()
    truth = drawn(tx90l, seed)
    found = flexible(*arm_side_logs(folder, truth, seed, 9))
    true = np.array([truth[f"{drive}.stiffness"] for drive in DRIVES])
    ends = np.array([found.interval(f"{drive}.stiffness") or (np.nan, np.nan) for drive in DRIVES])
    return np.array([(ends[:, 0] <= true) & (true <= ends[:, 1]), np.abs(stiffness(found) / true - 1)])


@pytest.mark.slow
def test_intervals_of_the_drives_cover(arm_side_logs, tx90l: RobotModel, tmp_path: Path) -> None:
    """Twenty robots, sixty stiffnesses: 95 % intervals hold at least 90 %, and the largest error is below 0.1 %."""
    found = over_seeds(of_one_robot, range(100, 120), tmp_path, arm_side_logs, tx90l)
    inside, off = np.swapaxes(found, 0, 1)
    print(f"{100 * inside.mean():.1f} % of {inside.size} intervals, largest error {100 * off.max():.3f} %")
    assert off.max() < 0.001
    assert inside.mean() >= 0.9, inside.mean(axis=0)
