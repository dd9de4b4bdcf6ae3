"""Two calibrations of one robot by a simulator that shares nothing with flexcal: what is said to have changed, did."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dh_arm import HOME, DHArm, postures, tracked, write_poses, write_robot
from over_seeds import over_seeds
from refusals import refused
from scipy.stats import binom

from flexcal import RobotModel, fit_geometry, read_poses
from flexcal.calibration.comparison import GeometryChange, compare_geometry
from flexcal.estimation import Estimate
from flexcal.model.robot import with_point
from flexcal.report.results import change_sentence

SIGMA = 2e-5


class Cell:
    """A robot that is calibrated again and again, with the tracker elsewhere each time."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.model = RobotModel.from_yaml(write_robot(folder), estimates=False)

    def calibrated(
        self, arm: DHArm, rng: np.random.Generator, q: np.ndarray, sigma: float = SIGMA
    ) -> Estimate:
        xyz = tracked(arm.points(q), rng, sigma)
        poses = read_poses(write_poses(self.folder / "poses.csv", q, xyz, sigma), self.model)
        fit = fit_geometry(self.model, poses, terms=("kinematic",))
        ranges = {f"joint_{k + 1}": (float(q[:, k].min()), float(q[:, k].max())) for k in range(6)}
        return replace(fit.estimate, ranges=ranges, provenance={"option.targets": "smr"})

    def compared(self, seed: int, after, q=postures, sigma: float = SIGMA, count: int = 45) -> GeometryChange:
        """The arm of a seed, and what `after` makes of it, with other poses."""
        rng, arm = np.random.default_rng(seed), DHArm.made(seed)
        first = self.calibrated(arm, rng, postures(rng, 45))
        second = self.calibrated(after(arm), rng, q(rng, count), sigma)
        return compare_geometry(self.model, first, second)


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Cell:
    return Cell(tmp_path_factory.mktemp("cell"))


def same(arm: DHArm) -> DHArm:
    return arm


def test_a_turned_axis_is_named_with_its_size(cell: Cell) -> None:
    for seed in range(3):
        found = cell.compared(seed, lambda arm: arm.turned(3, 3e-4))
        assert found.changed and found.probability < 1e-6
        (item,) = found.explanations
        assert item.subject == "joint_3.offset"
        assert abs(item.change[0] - 3e-4) < 4 * item.std[0] < 1e-4
        assert found.shifts[0].name == "joint_3.offset" or found.shifts[0].adjusted < 0.05
        assert change_sentence(found).startswith("changed (p < 1e-6): joint_3.offset by +0.")


def test_a_bumped_reflector_is_the_tool_and_no_joint(cell: Cell) -> None:
    for seed in range(3):
        found = cell.compared(seed, lambda arm: arm.bumped((3e-4, -2e-4, 3.5e-4)))
        (item,) = found.explanations
        assert item.subject == "smr" and item.alternatives == ()
        assert ": the place of smr on the tool by 0." in change_sentence(found)
        np.testing.assert_allclose(item.change, (3e-4, -2e-4, 3.5e-4), atol=3e-5)


def test_displacements_are_those_of_the_arm(cell: Cell) -> None:
    """Against both true arms, registered by brute force."""
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    found = cell.compared(0, lambda arm: arm.turned(3, 1e-3))
    arm = DHArm.made(0)
    before, after = arm.points(found.q), arm.turned(3, 1e-3).points(found.q)

    def left(p: np.ndarray) -> np.ndarray:
        return Rotation.from_rotvec(p[:3]).apply(after) + p[3:] - before

    truth = left(least_squares(lambda p: left(p).ravel(), np.zeros(6), xtol=1e-15, ftol=1e-15, gtol=1e-15).x)
    error = np.linalg.norm(found.displacement - truth, axis=1)
    assert np.abs(np.linalg.norm(found.points - before, axis=1)).max() < 5e-3
    assert (error < 3 * found.std + 2e-6).mean() > 0.97 and 0.3 < (error**2).mean() / (
        found.std**2
    ).mean() < 2
    assert np.corrcoef(found.displacement.ravel(), truth.ravel())[0, 1] > 0.99


def test_the_order_of_the_two_turns_the_signs_alone(cell: Cell) -> None:
    rng, arm = np.random.default_rng(7), DHArm.made(7)
    pair = [cell.calibrated(a, rng, postures(rng, 45)) for a in (arm, arm.turned(2, 2e-4))]
    there, back = compare_geometry(cell.model, *pair), compare_geometry(cell.model, *pair[::-1])
    assert there.probability == pytest.approx(back.probability, rel=1e-2)
    np.testing.assert_allclose(there.displacement, -back.displacement, atol=1e-6)


def narrow(rng: np.random.Generator, count: int) -> np.ndarray:
    """Postures about another one, in which the wrist hardly turns."""
    return HOME + 0.1 + rng.uniform(-1, 1, (count, 6)) * [0.3, 0.15, 0.15, 0.35, 0.1, 0.16]


def test_parameters_that_only_one_fit_holds_are_no_change(cell: Cell) -> None:
    """Twenty poses of small motions leave parameters undetermined, at nothing, that the first calibration has far from it."""
    beside_nothing = 0
    for seed in range(3):
        rng, arm = np.random.default_rng(seed), DHArm.made(seed)
        first = cell.calibrated(arm, rng, postures(rng, 45))
        second = cell.calibrated(arm, rng, narrow(rng, 20))
        held = [
            n for n in first.parameters.names if first.std(n) and n in second.parameters and not second.std(n)
        ]
        assert len(held) >= 2
        beside_nothing += sum(abs(first.values[n]) > 3 * (first.std(n) or 0.0) for n in held)
        found = compare_geometry(cell.model, first, second)
        assert not found.changed and found.combinations < 24
        bumped = cell.calibrated(arm.bumped((0.0, 1e-3, 0.0)), rng, narrow(rng, 20))
        assert compare_geometry(cell.model, first, bumped).changed
    assert beside_nothing >= 2


def test_joint_ranges_that_do_not_overlap_are_refused(cell: Cell) -> None:
    rng, arm = np.random.default_rng(1), DHArm.made(1)
    pair = [cell.calibrated(arm, rng, postures(rng, 45) + shift * np.eye(6)[1]) for shift in (0.0, 1.5)]
    with refused("E-CAL-032", "joint_2"):
        compare_geometry(cell.model, *pair)
    with refused("E-CAL-033", "smr", "other"):
        other = replace(pair[0], provenance={"option.targets": "other"})
        model = with_point(cell.model, "other", "flange", np.zeros(3))
        compare_geometry(model, pair[0], other)


def cell_of(seed: int, folder: Path) -> Cell:
    """A cell in a folder of the seed."""
    (folder := folder / str(seed)).mkdir()
    return Cell(folder)


def is_named(seed: int, folder: Path) -> bool:
    """Whether a zero of the third joint that is 0.1 mrad off is found."""
    found = cell_of(seed, folder).compared(seed, lambda arm: arm.turned(3, 1e-4))
    return found.changed and found.explanations[0].subject == "joint_3.offset"


@pytest.mark.slow
def test_power(tmp_path: Path) -> None:
    """A zero that is 0.1 mrad off, five times the noise over the arm's reach, is found and named."""
    assert sum(over_seeds(is_named, range(300, 320), tmp_path)) >= 18


def has_changed(seed: int, folder: Path, count: int, spread: float, sigma: float) -> bool:
    """Whether the same robot, measured again, is said to have changed."""

    def again(rng: np.random.Generator, n: int) -> np.ndarray:
        return postures(rng, n, spread) if spread else narrow(rng, n)

    return cell_of(seed, folder).compared(seed, same, again, sigma, count).changed


@pytest.mark.slow
@pytest.mark.parametrize("case", ["same", "few", "noisy", "narrow"])
def test_the_same_robot_has_not_changed(tmp_path: Path, case: str) -> None:
    """Forty robots measured twice, at other poses, with the tracker elsewhere; the second time few poses of small motions, or noise of
    0.1 mm.
    """
    count, spread, sigma = {
        "same": (45, 1.0, SIGMA),
        "few": (22, 0.3, SIGMA),
        "noisy": (45, 1.0, 1e-4),
        "narrow": (20, 0.0, SIGMA),
    }[case]
    changed = sum(over_seeds(has_changed, range(100, 140), tmp_path, count, spread, sigma))
    assert changed <= binom.ppf(0.99, 40, 0.05) and changed <= 2
