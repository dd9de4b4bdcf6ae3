"""What the size of a robot rests on where no instrument of points tells it: nominal lengths, beside sockets, wires and touched faces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from stranger_arm import SIX
from stranger_readings import Asked, ReadArm, readings, right

from flexcal import RobotModel, calibrate, read_poses
from flexcal.calibration.diagnostics import RobotSize
from flexcal.calibration.fit import common_lengths, geometric_parameters
from flexcal.data.poses import PoseSet
from flexcal.model.kinematics import point_kinematics


def distances(at: np.ndarray) -> np.ndarray:
    return np.linalg.norm(at[::2] - at[1::2], axis=1)


def errors(
    folder: Path, seed: int, asked: Asked, change: tuple[str, str] = ("", "")
) -> tuple[float, float, float, RobotSize]:
    """Errors of distances of the tool, m, of the calibrated robot and of the nominal one with its point found, relative error of its size,
    and what it rests on.
    """
    arm = ReadArm.drawn(seed)
    folder = folder / str(seed)
    _, _ = readings(folder, arm, [asked], seed)
    robot = folder / "robot.yaml"
    robot.write_text(robot.read_text().replace(*change))
    model = RobotModel.from_yaml(robot)
    result = calibrate(model, read_poses(folder / f"0_{asked.kind}.csv", model), terms=["kinematic"])
    q = arm.postures(300, np.random.default_rng([seed, 7]))
    true = distances(arm.points(q))
    found = distances(point_kinematics(result.model, q, point="smr", jacobians=False).position)
    nominal = distances((arm.tool(q, true=False) @ np.append(arm.true_xyz, 1.0))[:, :3])
    size = RobotSize.of(result.selected)
    assert size is not None
    return (
        float(np.sqrt(np.mean((found - true) ** 2))),
        float(np.sqrt(np.mean((nominal - true) ** 2))),
        float(found @ true / (true @ true) - 1),
        size,
    )


@pytest.mark.parametrize("kind", ["plane", "sphere"])
def test_contacts_make_no_robot_of_another_size(kind: str, tmp_path: Path) -> None:
    """They fit a robot of any size; with one length held its errors were those of all others, up to twice the uncalibrated robot's."""
    for seed in (11, 12, 13):
        found, nominal, off, size = errors(tmp_path, seed, right(kind, 120))
        assert found < nominal
        assert abs(off) < 3 * size.std < 3e-3
        assert size.sentence.startswith("none of these readings tells how large the robot is: all lengths")


def test_sockets_that_are_closer_than_declared_make_no_larger_robot(tmp_path: Path) -> None:
    """By 2.5 ‰, declared to 2 ‰: nominal lengths know better, and say by how much; without them errors are two to three times nominal."""
    every = []
    for seed in range(14, 20):
        found, nominal, off, size = errors(
            tmp_path, seed, right("sockets", 120), ("0.08, 0]}, std: 1.0e-6", "0.0802, 0]}, std: 1.6e-4")
        )
        every.append((found, nominal))
        assert abs(off) < 3 * size.std < 3e-3
        (sockets,) = size.standards
        assert sockets.seen is not None
        assert sockets.seen_std is not None
        assert abs(sockets.seen + 2.5e-3) < 3 * sockets.seen_std < 5e-3
    means = np.mean(every, axis=0)
    assert means[0] < 0.8 * means[1]


@pytest.mark.parametrize("kind", ["plane", "sockets"])
def test_a_link_of_another_length_is_named_and_not_trusted(kind: str, tmp_path: Path) -> None:
    """30 mm in the URDF, 60 tolerances: said of the length and of no other; contacts once made a robot that is a point, of no errors."""
    arm = ReadArm.drawn(3)
    readings(tmp_path, arm, [right(kind, 120)], 3)
    urdf = tmp_path / "arm.urdf"
    before, after = (
        f'name="a4" type="revolute"><parent link="l3"/><child link="l4"/><origin xyz="{x!r} '
        for x in (0.25, 0.28)
    )
    assert before in urdf.read_text()
    urdf.write_text(urdf.read_text().replace(before, after))
    model = RobotModel.from_yaml(tmp_path / "robot.yaml")
    result = calibrate(model, read_poses(tmp_path / f"0_{kind}.csv", model), terms=["kinematic"])
    assert result.trust.status == "bad"
    (said,) = (remark for remark in result.document()["remarks"] if remark.startswith("implausibly far"))
    assert said.startswith("implausibly far from the nominal value: a3.length_x (0 to -0.0")
    assert "," not in said
    lengths = [v for name, v in result.estimate.values.items() if name.startswith("a") and ".length_" in name]
    assert np.abs(lengths).max() < 0.04


def size_over_std(seed: int, folder: Path, asked: Asked, change: tuple[str, str]) -> tuple[float, float]:
    """Error of the size over its standard deviation, and what is seen of the sockets over theirs."""
    _, _, off, size = errors(folder, seed, asked, change)
    (sockets,) = size.standards
    return off / size.std, float(sockets.seen or 0.0) / float(sockets.seen_std or 1.0)


@pytest.mark.slow
def test_the_size_is_known_as_well_as_is_said(tmp_path: Path) -> None:
    """Over 30 arms; many readings do not pull it down."""
    change = ("std: 1.0e-6", "std: 1.6e-4")
    found = np.array(over_seeds(size_over_std, range(1200, 1230), tmp_path, right("sockets", 240), change))
    print(f"rms {np.sqrt(np.mean(found**2, axis=0))}, mean {found.mean(axis=0)}")
    assert np.all(np.abs(found.mean(axis=0)) < 3 * found.std(axis=0) / np.sqrt(len(found)))
    assert np.all(np.sqrt(np.mean(found**2, axis=0)) < 1.3)


def test_common_lengths_are_those_of_a_larger_robot(tmp_path: Path) -> None:
    """Motion of the tool by them, against the URDF of an arm with all axes farther apart."""
    models = []
    for size in (1.0, 1 + 1e-6):
        axes = tuple((direction, tuple(size * np.array(place))) for direction, place in SIX)
        models.append(RobotModel.from_yaml(ReadArm(3, axes=axes).write(tmp_path / str(size))))
    q = ReadArm.drawn(3).postures(40, np.random.default_rng(0))
    poses = PoseSet.unmeasured(q, np.full(40, "smr"), np.full(40, "tracker"), 1.0)
    parameters = geometric_parameters(
        models[0].with_priors({f"a{k}.length_{axis}": 1e-3 for k in range(1, 7) for axis in "xyz"}),
        poses,
        ["kinematic"],
    )
    common = dict(zip(parameters.names, common_lengths(models[0], parameters).tolist(), strict=True))
    changed = models[0].with_values({name: 1e-6 * value for name, value in common.items() if value})
    at = [point_kinematics(m, q, point="smr", jacobians=False).position for m in (*models, changed)]
    by_urdf, by_errors = ((end - at[0]) - (end - at[0]).mean(axis=0) for end in at[1:])
    np.testing.assert_allclose(by_errors, by_urdf, atol=1e-11)


@pytest.mark.parametrize("kind", ["plane", "wires"])
def test_errors_are_predicted_for_a_robot_whose_base_nothing_places(kind: str, tmp_path: Path) -> None:
    """Not 1.5 m, by rotations of the whole robot that these readings do not tell: those of the arm, its base placed by best fit."""
    arm = ReadArm.drawn(11)
    readings(tmp_path, arm, [right(kind, 120)], 11)
    model = RobotModel.from_yaml(tmp_path / "robot.yaml")
    result = calibrate(model, read_poses(tmp_path / f"0_{kind}.csv", model), terms=["kinematic"])
    assert not {"a1.offset", "a1.misalignment_1", "a1.misalignment_2"}.intersection(result.estimate.values)
    q = arm.postures(300, np.random.default_rng(7))
    found = point_kinematics(result.model, q, point="smr", jacobians=False).position
    true = arm.points(q)
    found, true = found - found.mean(axis=0), true - true.mean(axis=0)
    left, _, right_ = np.linalg.svd(true.T @ found)
    turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right_)]) @ right_
    error = np.sqrt(np.mean(np.sum((true - found @ turn.T) ** 2, axis=1)))
    assert result.extent is not None
    assert error / 2 < result.extent.inside < 1.5e-3
