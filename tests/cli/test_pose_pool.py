"""`design poses --from`: choosing among poses that are given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cli_files import read_csv, write_csv
from over_seeds import over_seeds
from refusals import assert_refusal
from test_bad_input import refused_run

from flexcal import RobotModel
from flexcal.calibration.fit import fit_geometry
from flexcal.calibration.verification import prediction_errors
from flexcal.data.plans import PosePlan, read_plan_of
from flexcal.data.poses import PoseSet, read_poses
from flexcal.design.optimality import SpectralCriterion, exchange
from flexcal.design.poses import base_sensitivity, pose_sensitivity

POSES = 40


def test_forty_poses_chosen_from_the_ur5_grid_calibrate_it(run, ur5_folder: Path) -> None:
    """The published line: rigid geometry, trained on 40 poses of our own exchange, mean at most 0.115 mm on the 960 others.

    The criterion is the paper's, σ_min of ΘᵀΘ (Neubauer et al. 2015, §5.2), not chosen for the result.
    """
    robot, grid = ur5_folder / "robot.yaml", ur5_folder / "grid.csv"
    header, rows = read_csv(grid)
    arguments = (
        robot,
        "--from",
        grid,
        "--count",
        POSES,
        "--criterion",
        "E",
        "--out",
        ur5_folder / "plan.yaml",
    )
    document = run("design", "poses", *arguments, "--json").document
    chosen = np.array(document["chosen"])
    assert len(np.unique(chosen)) == POSES and document["flank_not_sure"] == []
    # nothing was drawn, so there is no seed, on the page neither
    page = (ur5_folder / "plan.html").read_text(encoding="utf-8")
    assert (
        document["seed"] is None
        and "Plan plan.yaml, chosen from given poses" in page
        and ", seed" not in page
    )
    assert set(document["criteria"]) == {"c", "A", "D", "E", "O1", "O2", "O3", "O4", "O5"}
    np.testing.assert_array_equal(read_plan_of(ur5_folder / "plan.yaml", PosePlan).q, rows[chosen, 1:7])
    train = write_csv(ur5_folder / "train.csv", header, rows[chosen])
    others = write_csv(ur5_folder / "others.csv", header, np.delete(rows, chosen, axis=0))
    assert run("calibrate", robot, train, "--terms", "kinematic").status == 0
    found = run("verify", robot, others, "--json").document["verification"]["measured"]
    assert found["poses"] == 960
    assert found["mean_mm"] <= 0.115


def mean_error_of_others(seed: int, ur5: RobotModel, poses: PoseSet, pool: np.ndarray) -> float:
    """Mean error, m, at the poses that an exchange from a random start did not choose."""
    start = np.random.default_rng(seed).choice(len(poses), POSES, replace=False)
    chosen = exchange(pool, POSES, SpectralCriterion("E"), start=start).chosen
    fitted = fit_geometry(ur5, poses.subset(chosen), terms=("kinematic",), elastic=False).model
    rest = poses.subset(np.setdiff1d(np.arange(len(poses)), chosen))
    return prediction_errors(fitted, rest, elastic=False).all.mean


@pytest.mark.slow
def test_where_the_exchange_starts_moves_the_result_by_hundredths_of_a_millimetre(
    ur5, examples: Path
) -> None:
    """Over 40 random starts: 0.1124 ± 0.0014 mm, 0.1104 to 0.1169, three above 0.115; sets drawn at random: 0.1166 ± 0.0045 mm."""
    poses = read_poses(examples / "ur5_tracker" / "grid.csv", ur5)
    pool = base_sensitivity(pose_sensitivity(ur5, poses.q)).sensitivity
    means = over_seeds(mean_error_of_others, range(8), ur5, poses, pool)
    print(f"{1e3 * np.mean(means):.4f} mm, at most {1e3 * max(means):.4f}")
    assert np.mean(means) < 0.115e-3 and max(means) < 0.120e-3


def test_poses_that_gravity_does_not_preload_are_left_out_by_number(
    run, tx90l_folder: Path, rng: np.random.Generator
) -> None:
    q = rng.uniform(-2, 2, (120, 6))
    file = write_csv(
        tx90l_folder / "taught.csv",
        ["pose", *(f"q{i}" for i in range(1, 7))],
        np.column_stack([np.arange(120), q]),
    )
    arguments = (
        tx90l_folder / "robot.yaml",
        "--from",
        file,
        "--count",
        20,
        "--out",
        tx90l_folder / "plan.yaml",
    )
    document = run("design", "poses", *arguments, "--json").document
    left_out = document["flank_not_sure"]
    assert 0 < len(left_out) < 60 and not set(left_out) & set(document["chosen"])
    hidden = document["not_seen"]
    assert 0 < len(hidden) < 30 and not set(hidden) & (set(document["chosen"]) | set(left_out))
    assert document["candidates"] == 120 - len(left_out) - len(hidden)


def test_a_pose_outside_the_limits_is_refused(run, tx90l_folder: Path) -> None:
    rows = np.column_stack([np.arange(5), np.zeros((5, 6))])
    rows[3, 2] = 2.6
    file = write_csv(tx90l_folder / "taught.csv", ["pose", *(f"q{i}" for i in range(1, 7))], rows)
    arguments = (
        "design",
        "poses",
        tx90l_folder / "robot.yaml",
        "--from",
        file,
        "--out",
        tx90l_folder / "plan.yaml",
    )
    sentence = refused_run(run, tx90l_folder, *arguments)
    assert_refusal(sentence, "E-TABLE-002", "taught.csv line 5, column q2", "pose 3", "joint_2")


def test_random_and_given_poses_exclude_each_other(run, ur5_folder: Path) -> None:
    arguments = ("design", "poses", ur5_folder / "robot.yaml", "--random", "--from", ur5_folder / "grid.csv")
    assert_refusal(refused_run(run, ur5_folder, *arguments, "--out", ur5_folder / "plan.yaml"), "E-CLI-023")


FREQUENCY = [
    (
        "default,2,0,60.1,",
        "default,2,0,145,",
        ["E-TABLE-002", "line 3, column q2_deg: pose 2", "0.0611 rad", "limits of joint_2"],
    ),
    (
        "default,2,0,60.1,",
        "default,2,0,188,",
        ["E-TABLE-002", "line 3, column q2_deg: pose 2", "limits of joint_2"],
    ),
    ("default,2,0,60.1,", "default,2,0,60.1x,", ["E-TABLE-036", "3", "q2_deg", "not a number"]),
    ("q6_deg", "q6", ["E-RUN-041", "line 1", "q6_deg"]),
]


@pytest.mark.parametrize(("right", "wrong", "refusal"), FREQUENCY)
def test_frequency_poses_that_do_not_fit(
    run, tx90l_folder: Path, right: str, wrong: str, refusal: list[str]
) -> None:
    file = tx90l_folder / "frequency_poses.csv"
    text = file.read_text()
    assert right in text
    file.write_text(text.replace(right, wrong))
    arguments = ("design", "frequency", tx90l_folder / "robot.yaml", "--out", tx90l_folder / "plan.yaml")
    sentence = refused_run(run, tx90l_folder, *arguments)
    code, *names = refusal
    assert_refusal(sentence, code, "frequency_poses.csv", *names)


def test_only_excited_joints_need_room(run, tx90l_folder: Path) -> None:
    """joint_5 ends at 140.0 degrees: braked at 139.5 it needs no room; joint_2 ends at 147.5 and needs 3.5."""
    file = tx90l_folder / "frequency_poses.csv"
    file.write_text(
        file.read_text().replace("default,2,0,60.1,-105.0,79.6,67.5", "default,2,0,143.9,-105.0,79.6,139.5")
    )
    arguments = (tx90l_folder / "robot.yaml", "--out", tx90l_folder / "plan.yaml")
    assert run("design", "frequency", *arguments).status == 0
