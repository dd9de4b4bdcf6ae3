"""How many readings, how good, what accuracy: points, full poses, wires, sockets, touched faces, views of a board.

`python -m benchmarks.kinds_grid [--kinds wires sockets …] [--sizes 12 …] [--robots 10] [--first 0] [--processes 2]`

Robots are of the tests' simulators, with axes off by 0.3 to 0.5 mm and 0.5 to 1 mrad. Errors are those of the point at fresh poses after
the best rigid placement of the base, which some kinds do not tell, beside those of the nominal robot with base and point found from the
same readings. The wrong ones are told apart as in `pose_grid`; no fresh poses are verified.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process a core below

import argparse
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks._tasks import in_parallel
from benchmarks.few_poses import FRESH
from benchmarks.pose_grid import Tried, verdicts
from flexcal import PoseSet, RobotModel, calibrate, read_poses
from flexcal.calibration.verification import uncalibrated_model
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import propagated_covariance_root

TESTS = Path(__file__).parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "cli")]

from tests.cli.stranger_readings import ReadArm, readings, right  # noqa: E402
from tests.cli.test_camera import ROBOT, SQUARE, Cell  # noqa: E402
from tests.cli.test_full_poses import urdf  # noqa: E402

SIZES = (12, 40, 120)
ROWS = {
    "points": 1,
    "poses": 1,
    "wire": 3,
    "wires": 3,
    "sockets": 2,
    "plane": 3,
    "sphere": 3,
    "line": 3,
    "dial": 3,
    "board": 1,
}
"""Rows by kind, for each of a size: what gives one number needs three times as many as points."""
NOISES_UM = (10.0, 100.0, 1000.0)
PIXELS = 2e-3
"""Noise of a corner of a board, pixels, for each micrometre."""

Simulated = tuple[RobotModel, PoseSet, str, np.ndarray, Callable[[np.ndarray], np.ndarray]]


def _read(kind: str, count: int, noise_um: float, seed: int, folder: Path) -> Simulated:
    """Robot and its readings, the point, fresh poses, and the true point at poses (N, 3), m, in the base's frame."""
    if kind == "board":
        cell = Cell(seed)
        urdf(folder / "six.urdf")
        (folder / "robot.yaml").write_text(ROBOT.format(square=SQUARE))
        model = RobotModel.from_yaml(folder / "robot.yaml")
        views = cell.corners(folder / "views.csv", count, noise=PIXELS * noise_um)
        q = np.array(cell.poses(FRESH))
        return (
            model,
            read_poses(views, model),
            "camera",
            q,
            lambda at: np.array([cell.camera(row)[0] for row in at]),
        )
    arm = ReadArm.drawn(seed)
    model, poses = readings(folder, arm, [right(kind, count, 1e-6 * noise_um)], seed)
    return model, poses, "smr", arm.postures(FRESH, np.random.default_rng([seed, 5])), arm.points


def _placed(at: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Errors (N, 3) of points after the best rotation and displacement (Kabsch 1976)."""
    at, true = at - at.mean(axis=0), true - true.mean(axis=0)
    left, _, right = np.linalg.svd(at.T @ true)
    return at @ left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right - true


def one(task: tuple[str, int, float, int]) -> tuple[str, Tried]:
    """Calibrate one robot."""
    kind, count, noise_um, seed = task
    begin = Tried(seed, 6, count, noise_um)
    with tempfile.TemporaryDirectory() as place:
        model, poses, point, q, points = _read(kind, count, noise_um, seed, Path(place))
        true = points(q)
        start = time.process_time()
        try:
            own = calibrate(model, poses, terms=["auto"])
        except FlexcalError as error:
            return kind, replace(begin, refused=f"{error.code}: {error}")
        seconds = time.process_time() - start
        nominal = uncalibrated_model(model, poses)

    def off(robot: RobotModel) -> np.ndarray:
        at = point_kinematics(robot, q, point=point, jacobians=False).position
        return _placed(at, true).ravel()

    before, after = (
        float(np.percentile(np.linalg.norm(off(robot).reshape(-1, 3), axis=1), 90))
        for robot in (nominal.own or nominal.registered or model, own.model)
    )
    expected = np.linalg.norm(propagated_covariance_root(own.model, off))
    return kind, replace(
        begin,
        before=1e3 * before,
        after=1e3 * after,
        ratio=float(np.linalg.norm(off(own.model)) / expected),
        trust=own.trust.status,
        reasons=(own.trust.because,),
        seconds=seconds,
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kinds", nargs="+", default=list(ROWS), choices=list(ROWS))
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    given = parser.parse_args()
    tasks = [
        (kind, ROWS[kind] * size, noise, seed)
        for kind in given.kinds
        for size in given.sizes
        for noise in NOISES_UM
        for seed in range(given.first, given.first + given.robots)
    ]
    cells: dict[tuple[str, int, float], list[Tried]] = defaultdict(list)
    for kind, tried in in_parallel(
        one, tasks, processes=given.processes, show=lambda found: f"{found[0]}: {found[1].told(whole=False)}"
    ):
        cells[kind, tried.poses, tried.noise_um].append(tried)
    print(f"P90 before -> after, mm, median of {given.robots} robots; observed over predicted, rms of all")
    for (kind, rows, noise), own in cells.items():
        done = [t for t in own if not t.refused]
        ratio = np.sqrt(np.mean([t.ratio**2 for t in done] or [np.nan]))
        print(
            f"{kind:>8} {rows:4d} rows, {noise:5g} µm: {np.median([t.before for t in done] or [np.nan]):.2f} -> "
            f"{np.median([t.after for t in done] or [np.nan]):.3f}, {ratio:.2f}; {verdicts(own)}"
        )


if __name__ == "__main__":
    main()
