"""P90 at fresh poses of robots calibrated on few poses, with tolerances of manufacture as prior and without, random or designed.

`python -m benchmarks.few_poses [--robots 20] [--first 100] [--poses 6 8 …] [--arms panda ur tx90l] [--processes 2] [--no-design]`; with
`--regions` instead poses in small regions of the joints' ranges, and errors over the whole of these.

Robots are of the tests' simulator, which shares no code with flexcal: joints off by 0.4 mm and 0.7 mrad (1σ each), every drive yields under
gravity, a tracker of 20 µm. Uncalibrated is the nominal robot with base and point found from the same poses.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process a core below

import argparse
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks._tasks import in_parallel
from flexcal import PoseRequest, RobotModel, calibrate, design_poses, read_poses
from flexcal.calibration.measurement import predict_measurements, with_stations_at_base
from flexcal.calibration.verification import PredictionErrors, best_placement, prediction_errors
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from tests.jobs.yielding_robot import (
    PANDA_LIKE,
    TX90L_LIKE,
    UR_LIKE,
    Body,
    YieldingRobot,
    write_robot,
)

ARMS = {"panda": PANDA_LIKE, "ur": UR_LIKE, "tx90l": TX90L_LIKE}
POSES = (6, 8, 10, 12, 14, 18, 25, 40)
FRESH = 200
_YIELD = 1e-3
"""Rotation of a drive, rad, under the largest gravity torque of all that it carries, 30 % apart from joint to joint (1σ)."""


@dataclass(frozen=True)
class Tried:
    """One robot on so many poses: P90 at fresh ones, mm, by way; and observed over predicted errors with the prior."""

    arm: str
    seed: int
    poses: int
    p90: dict[str, float]
    ratio: float
    region: str = ""
    trust: str = ""


def drawn(arm: str, seed: int) -> YieldingRobot:
    """Robot of an arm as built."""
    bodies = ARMS[arm]
    rng = np.random.default_rng([seed, len(arm)])
    return YieldingRobot(bodies, drive_compliance(bodies, rng), rng)


def drive_compliance(bodies: tuple[Body, ...], rng: np.random.Generator) -> np.ndarray:
    """Compliance (n, 3) of every joint, rad/(N m): of its drive alone."""
    compliance = np.zeros((len(bodies), 3))
    compliance[:, 2] = _YIELD / _loads(bodies) * np.exp(rng.normal(0, 0.3, len(bodies)))
    return compliance


def _loads(bodies: tuple[Body, ...]) -> np.ndarray:
    """Largest gravity torque (n,) about each joint, N m, if all that it carries is stretched out, and no less than 5 % of the most."""
    reach = [float(np.linalg.norm(body.xyz)) for body in bodies]
    loads = np.array(
        [
            sum(
                9.81 * body.mass * (sum(reach[i + 1 : k + 1]) + 0.05)
                for k, body in enumerate(bodies)
                if k >= i
            )
            for i in range(len(bodies))
        ]
    )
    return np.maximum(loads, 0.05 * loads.max())


REGIONS = ("3 degrees", "15 degrees", "quarter", "wrist still")
"""Parts of the joints' ranges: around a random pose, a quarter of every range, or half of it with a wrist that moves by 3°."""


def poses_in(region: str, robot: YieldingRobot, count: int) -> np.ndarray:
    """Random poses (count, n) in a region of a robot's joint ranges."""
    low, high = np.array([body.limits for body in robot.bodies]).T
    n, rng = len(low), robot.rng
    half = {
        "3 degrees": np.full(n, np.deg2rad(3)),
        "15 degrees": np.full(n, np.deg2rad(15)),
        "quarter": (high - low) / 8,
        "wrist still": np.where(np.arange(n) < n - 3, (high - low) / 4, np.deg2rad(3)),
    }[region]
    centre = rng.uniform(low + half, high - half)
    return rng.uniform(centre - half, centre + half, (count, n))


def uncalibrated_p90(model: RobotModel, poses: PoseSet, fresh: PoseSet) -> float:
    """P90, m, of the nominal robot with base and point found from the poses."""
    at_base = with_stations_at_base(model.with_stations(poses.places))
    tool = predict_measurements(at_base, poses, elastic=False).kinematics
    placement = best_placement(poses, tool.position, tool.orientation)
    return prediction_errors(at_base.with_values(placement.values(at_base)), fresh).all.p90


def observed_over_predicted(errors: PredictionErrors) -> float:
    """Ratio of root mean square errors to those that were predicted."""
    return float(np.sqrt(np.sum(errors.errors**2) / np.sum(errors.expected_rms**2)))


def in_region(task: tuple[str, int, str]) -> Tried:
    """Calibrate one robot on 50 poses of a region, with and without the prior; P90 over the joints' ranges."""
    arm, seed, region = task
    robot = drawn(arm, seed)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        model = RobotModel.from_yaml(write_robot(folder, ARMS[arm]), estimates=False)
        poses = read_poses(robot.write_at(folder / "fit.csv", poses_in(region, robot, 50)), model)
        fresh = read_poses(
            robot.write(folder / "fresh.csv", FRESH, noise=False), model.with_stations(poses.places)
        )
        uncalibrated = uncalibrated_p90(model, poses, fresh)
        without = prediction_errors(calibrate(model, poses, tolerances=False).model, fresh).all.p90
        own = calibrate(model, poses)
        errors = prediction_errors(own.model, fresh)
    p90 = {"uncalibrated": uncalibrated, "without prior": without, "with prior": errors.all.p90}
    return Tried(
        arm,
        seed,
        50,
        {way: 1e3 * e for way, e in p90.items()},
        observed_over_predicted(errors),
        region,
        own.trust.status,
    )


def show_regions(rows: list[Tried], told: str) -> None:
    """One line of robots that were calibrated in regions."""
    over = {way: np.array([t.p90[way] / t.p90["uncalibrated"] for t in rows]) for way in rows[0].p90}
    parts = (
        f"{way}: median {np.median(x):.2f}, above 1.05 in {np.sum(x > 1.05)}"
        for way, x in over.items()
        if way != "uncalibrated"
    )
    ratios = np.array([t.ratio for t in rows])
    verdicts = ", ".join(f"{s} {sum(t.trust == s for t in rows)}" for s in ("good", "care", "unknown", "bad"))
    print(
        f"{told}, {len(rows)} robots, P90 over that of the uncalibrated: {'; '.join(parts)}; observed over predicted median "
        f"{np.median(ratios):.2f}, largest {ratios.max():.2f}; verdicts {verdicts}"
    )


def one(task: tuple[str, int, int], designed: bool) -> Tried:
    """Calibrate one robot on some poses in all ways."""
    arm, seed, count = task
    robot = drawn(arm, seed)
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        model = RobotModel.from_yaml(write_robot(folder, ARMS[arm]), estimates=False)
        robot.write(folder / "random.csv", count)
        robot.write(folder / "fresh.csv", FRESH, noise=False)
        files = {"random": folder / "random.csv"}
        if designed:
            plan = design_poses(model, PoseRequest(count=count, candidates=1000, seed=seed)).plan
            files["designed"] = robot.write_at(folder / "designed.csv", plan.q)
        ratio = np.nan
        for way, file in files.items():
            poses = read_poses(file, model)
            placed = model.with_stations(poses.places)
            fresh = read_poses(folder / "fresh.csv", placed)
            if way == "random":
                found["uncalibrated"] = uncalibrated_p90(model, poses, fresh)
                try:
                    without = calibrate(model, poses, tolerances=False).model
                    found["without prior"] = prediction_errors(without, fresh).all.p90
                except FlexcalError:
                    found["without prior"] = np.nan
            errors = prediction_errors(calibrate(model, poses).model, fresh)
            found[way] = errors.all.p90
            if way == "random":
                ratio = observed_over_predicted(errors)
    return Tried(arm, seed, count, {way: 1e3 * p90 for way, p90 in found.items()}, ratio)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--poses", type=int, nargs="+", default=POSES)
    parser.add_argument("--arms", nargs="+", default=list(ARMS), choices=list(ARMS))
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--no-design", action="store_true")
    parser.add_argument("--regions", action="store_true")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.robots)
    if given.regions:
        regions = [(given.arms[s % len(given.arms)], s, region) for region in REGIONS for s in seeds]
        found = in_parallel(in_region, regions, processes=given.processes)
        for region in REGIONS:
            show_regions([t for t in found if t.region == region], region)
        show_regions(found, "all")
        return
    tasks = [(arm, seed, count) for arm in given.arms for count in given.poses for seed in seeds]
    rows: dict[tuple[str, int], list[Tried]] = defaultdict(list)
    for tried in in_parallel(one, tasks, not given.no_design, processes=given.processes):
        rows[tried.arm, tried.poses].append(tried)
    print(f"P90, mm, median (worst) of {given.robots} robots; refused: share of them")
    for (arm, count), own in rows.items():
        told = []
        for way in own[0].p90:
            values = np.array([t.p90[way] for t in own])
            known = values[np.isfinite(values)]
            refused = f", {np.mean(~np.isfinite(values)):.0%} refused" if len(known) < len(values) else ""
            told.append(
                f"{way} {np.median(known):.3f} ({known.max():.2f}){refused}"
                if len(known)
                else f"{way} refused"
            )
        ratio = np.array([t.ratio for t in own])
        worse = np.mean([t.p90["random"] > t.p90["uncalibrated"] for t in own])
        print(
            f"{arm:6s} {count:3d} poses: {'; '.join(told)}; observed over predicted {np.median(ratio):.2f} ({ratio.max():.2f}), worse than "
            f"uncalibrated {worse:.0%}"
        )


if __name__ == "__main__":
    main()
