"""The geometric fit, 47 parameters on 200 poses from nominal to convergence, against pybotics on 24 parameters and 200 poses."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from benchmarks.peers import run_peer
from flexcal.calibration.fit import fit_geometry
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.model.robot import GEOMETRY, RobotModel

POSES = 200


def run() -> list[tuple[str, float, str]]:
    """Ratios; ours with and without the elasticity (which re-estimates 34 parameters more)."""
    peer = run_peer("pybotics_fit.py", ("pybotics==3.1.2", "scipy>=1.14"), {"poses": POSES, "seed": 1})
    model = RobotModel.from_yaml(
        Path(__file__).parent.parent / "examples" / "tx90l" / "robot.yaml", estimates=False
    )
    rng = np.random.default_rng(1)
    owners = (*model.joint_names, "tool")
    truth = {
        f"{o}.{key}": (3e-4 if "length" in key else 5e-4) * rng.normal() for o in owners for key in GEOMETRY
    }
    truth |= {"joint_2.backlash": 4e-5, "joint_3.backlash": 3e-5} | {
        f"station.tracker.{k}": 3e-4 * rng.normal() for k in "xyz"
    }
    results = []
    for label, elastic in (("rigid", False), ("elastic", True)):
        poses = _simulated(model.with_values(truth), elastic, rng)
        seconds = min(_seconds(model, poses, elastic) for _ in range(5))
        fit = fit_geometry(model, poses, elastic=elastic)
        kept = fit.identifiability.diagonal[: fit.identifiability.rank]
        note = (
            f"{peer['seconds']:.2f} s (condition {peer['condition']:.1e}, left {peer['mean_mm']:.3f} mm) against {seconds * 1e3:.1f} ms "
            f"(rank {fit.identifiability.rank}, spread of R {kept.max() / kept.min():.0f}, left {fit.errors.mean * 1e3:.3f} mm)"
        )
        results.append(
            (f"geometric fit of {POSES} poses, {label}, pybotics", peer["seconds"] / seconds, note)
        )
    return results


def _simulated(robot: RobotModel, elastic: bool, rng: np.random.Generator) -> PoseSet:
    limits = np.array([(joint.lower, joint.upper) for joint in robot.joints])
    q = rng.uniform(limits[:, 0], limits[:, 1], (POSES, robot.n))
    sigma = np.full((POSES, 3), 3e-5)
    names = np.full(POSES, robot.point().name), np.full(POSES, robot.stations.names[0])
    empty = PoseSet(q, np.zeros((POSES, 3)), sigma, None, None, *names, None, np.arange(POSES))
    points = predict_measurements(robot, empty, elastic=elastic).position + 3e-5 * rng.normal(size=(POSES, 3))
    return PoseSet(q, points, sigma, None, None, *names, None, np.arange(POSES))


def _seconds(model: RobotModel, poses: PoseSet, elastic: bool) -> float:
    started = time.perf_counter()
    fit_geometry(model, poses, elastic=elastic)
    return time.perf_counter() - started
