"""Stiffness of all drives from points with and without a known force at the tool, on an arm of strangers that bends in its own way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from stranger_arm import SIX, StrangerArm, rigid, rodrigues

from flexcal import RobotModel, calibrate, read_poses
from flexcal.calibration.measurement import predict_measurements

DECLARED = np.array([9e4, 8e4, 6e4, 1.2e4, 1e4, 6e3])
MASS, GRAVITY = 2.0, np.array([0, 0, -9.81])
ELASTIC = "elastic:\n" + "".join(
    f"  - {{joint: a{i + 1}, drive: {{stiffness: {k}, damping: 10}}}}\n" for i, k in enumerate(DECLARED)
)


class BendingArm(StrangerArm):
    """Its drives give way to the weight of its links, whose mass is at the axes, and to what pulls at the reflector."""

    stiffness: np.ndarray

    def energy(self, q: np.ndarray, force: np.ndarray) -> float:
        """Potential energy, J, of links and force at arm angles `q` (n,)."""
        at, height = np.eye(4), 0.0
        for angle, direction, origin, nominal in zip(
            q + self.zeros, self.true_direction, self.true_origin, self.origin, strict=True
        ):
            turned = rodrigues(direction, angle)
            at = at @ rigid(turned, origin - turned @ origin)
            height -= MASS * GRAVITY @ (at @ np.append(nominal, 1.0))[:3]
        return float(height - force @ (self.tool(q[None], true=True)[0] @ np.append(self.true_xyz, 1.0))[:3])

    def rest(self, q: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Arm angles (n,) with the motors at `q` (n,)."""
        bent, step = np.zeros(self.n), 1e-5
        for _ in range(12):
            slope = [
                (self.energy(q + bent + step * e, force) - self.energy(q + bent - step * e, force))
                / (2 * step)
                for e in np.eye(self.n)
            ]
            bent = -np.array(slope) / self.stiffness
        return q + bent


def recorded(folder: Path, seed: int, sigma: float, count: int = 30) -> tuple[BendingArm, Path, Path]:
    """robot.yaml with the declared springs, and points in which every pose is measured free, and pulled in a random direction."""
    arm, rng = BendingArm(seed, axes=tuple(SIX)), np.random.default_rng(seed)
    arm.stiffness = DECLARED * np.exp(0.15 * rng.normal(size=6))
    robot = arm.write(folder, ELASTIC)
    lines = ["pose,q1,q2,q3,q4,q5,q6,x,y,z,sigma,fx,fy,fz"]
    for k, q in enumerate(arm.postures(count, rng)):
        pull = rng.normal(size=3)
        for visit, force in enumerate((np.zeros(3), 200.0 * pull / np.linalg.norm(pull))):
            at = arm.measured(arm.rest(q, force)[None], rng, sigma)[0]
            numbers = [*q.tolist(), *at.tolist(), max(sigma, 1e-6), *force.tolist()]
            lines.append(",".join([str(2 * k + visit), *map(repr, numbers)]))
    file = folder / "pulled.csv"
    file.write_text("\n".join(lines) + "\n")
    return arm, robot, file


def test_a_pulled_tool_tells_every_drive(tmp_path: Path) -> None:
    """Within their intervals, and to a few percent, those of base and wrist too, which gravity does not load."""
    arm, robot, file = recorded(tmp_path, 4, 1e-5)
    model = RobotModel.from_yaml(robot)
    poses = read_poses(file, model)
    found = calibrate(model, poses, terms=["kinematic"]).estimate
    for i, true in enumerate(arm.stiffness):
        low, high = found.interval(f"a{i + 1}.drive.stiffness")  # type: ignore[misc]
        assert 0.97 * low < true < 1.03 * high
        assert (high - low) / true < 0.12
    free = poses.subset(~poses.force.any(axis=1))
    alone = calibrate(model, free, terms=["kinematic"]).estimate
    assert alone.interval("a1.drive.stiffness") is None


def test_the_deflection_under_a_force_is_that_of_the_stranger(tmp_path: Path) -> None:
    """Exact springs and geometry: predicted to micrometres, of millimetres."""
    arm, robot, file = recorded(tmp_path, 6, 0.0, 12)
    arm_model = RobotModel.from_yaml(robot)
    poses = read_poses(file, arm_model)
    model = arm_model.with_values(
        {f"a{i + 1}.drive.stiffness": float(k) for i, k in enumerate(arm.stiffness)}
    )
    calibrated = calibrate(model, poses, terms=["kinematic"]).model
    pulled = poses.force.any(axis=1)
    moved = predict_measurements(calibrated, poses).position
    shift, truth = moved[pulled] - moved[~pulled], poses.position[pulled] - poses.position[~pulled]
    assert np.linalg.norm(truth, axis=1).mean() > 0.5e-3
    assert np.linalg.norm(shift - truth, axis=1).max() < 0.01 * np.linalg.norm(truth, axis=1).max()


def test_derivatives_under_a_force(tmp_path: Path) -> None:
    """Against differences, of springs and of compliances about and across the axes."""
    _, robot, file = recorded(tmp_path, 7, 0.0, 6)
    model = RobotModel.from_yaml(robot)
    poses = read_poses(file, model)
    names = ["a1.drive.stiffness", "a5.drive.stiffness", "a2.gravity_compliance", "a4.gravity_compliance_1"]
    names += ["a3.gravity_compliance_2", "a3.offset"]
    columns = predict_measurements(model, poses, jacobians=True).jacobian(names)
    for k, name in enumerate(names):
        step = (
            1e-4 * model.value(name) if name.endswith("stiffness") else 1e-8 if "compliance" in name else 1e-6
        )
        above, below = (
            predict_measurements(model.with_values({name: model.value(name) + h}), poses).residual
            for h in (step, -step)
        )
        slope = (below - above) / (2 * step)
        scale = np.abs(slope).max()
        assert np.abs(slope - columns[:, :, k]).max() < 0.02 * scale, name


def drives_inside(seed: int, folder: Path) -> list[bool]:
    """Whether the stiffnesses of one arm's drives lie in their intervals."""
    arm, robot, file = recorded(folder / str(seed), seed, 1e-5)
    model = RobotModel.from_yaml(robot)
    found = calibrate(model, read_poses(file, model), terms=["kinematic"]).estimate
    inside = []
    for i, true in enumerate(arm.stiffness):
        interval = found.interval(f"a{i + 1}.drive.stiffness")
        assert interval is not None
        inside.append(interval[0] < true < interval[1])
    return inside


@pytest.mark.slow
def test_intervals_of_pulled_drives_cover(tmp_path: Path) -> None:
    """Of 15 arms."""
    assert np.mean(over_seeds(drives_inside, range(30, 45), tmp_path)) > 0.9
