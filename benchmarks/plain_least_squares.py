"""Fits of full poses and of a camera's views against SciPy's `least_squares` with differences on a plain NumPy model.

The plain model multiplies transforms pose by pose, as a script does; the same data go to both, from nominal to convergence. Ours
estimates the noise, the rank and the intervals too.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.spatial.transform import Rotation

from flexcal.calibration.fit import fit_geometry
from flexcal.data.poses import PoseSet, read_poses
from flexcal.model.robot import RobotModel

FASTER = 50.0
"""Ratio that is wanted."""
MOST_OVER_POINTS = 1.5
"""Largest ratio of a fit of full poses to that of the same points."""
POSES = 200
NOISE, TURN_NOISE = 3e-5, 1e-4
NOMINAL = np.zeros((7, 6))
NOMINAL[-1] = [0, 0, 0, 0.05, 0.03, 0.1]
_PLACE = np.array([0.4, -0.2, 1.9, 2.5, 0.3, 0.6])
_SPREAD = np.array([0.6, 0.5, 0.5, 0.9, 0.9, 1.2])
_BENT = np.array([0.2, -1.2, 1.4, -0.3, 1.2, 0.1])
_CAMERA = np.array([1100.0, 1090.0, 630.0, 490.0, -0.1, 0.05, 0.0, 0.0, 0.0])
_SIZE = (1280, 960)
_BOARD = np.array([[0.03 * c, 0.03 * r, 0.0] for r in range(1, 7) for c in range(1, 9)])
_PIXEL = 0.2


@dataclass(frozen=True, eq=False)
class PlainArm:
    """Product of transforms of a six-joint arm: six errors (rotation vector, shift) before every joint, and six of what it carries."""

    model: RobotModel

    def carried(self, q: np.ndarray, errors: np.ndarray) -> np.ndarray:
        """Transform (4, 4) of what the last link carries at one posture `q` (6,), with `errors` (7, 6)."""
        at = np.eye(4)
        for joint, angle, error in zip(self.model.joints, q, errors[:-1], strict=True):
            fixed, turned = np.eye(4), np.eye(4)
            fixed[:3, :3] = joint.rotation @ Rotation.from_rotvec(error[:3]).as_matrix()
            fixed[:3, 3] = joint.translation + error[3:]
            turned[:3, :3] = Rotation.from_rotvec(angle * joint.axis).as_matrix()
            at = at @ fixed @ turned
        last = np.eye(4)
        last[:3, :3], last[:3, 3] = Rotation.from_rotvec(errors[-1, :3]).as_matrix(), errors[-1, 3:]
        return at @ last


@dataclass(frozen=True, eq=False)
class FullPoses:
    """Full poses of a UR5 with errors at every joint, as a tracker reads them: the arm, and `q` (N, 6), `points` (N, 3) and `turns`."""

    arm: PlainArm
    q: np.ndarray
    points: np.ndarray
    turns: Rotation

    @classmethod
    def measured(cls, seed: int, poses: int = POSES, *, noisy: bool = True, draw: int = 0) -> FullPoses:
        """Poses of the robot of a seed; of another `draw`, other poses of the same robot."""
        arm, rng = PlainArm(_ur5()), np.random.default_rng(seed)
        truth = NOMINAL + rng.normal(size=(7, 6)) * [*3 * [5e-4], *3 * [3e-4]]
        rng = np.random.default_rng([seed, draw])
        q = _BENT + _SPREAD * rng.uniform(-1, 1, (poses, 6))
        station, noise = Rotation.from_rotvec(_PLACE[:3]), float(noisy)
        at = np.array([arm.carried(row, truth) for row in q])
        points = station.apply(at[:, :3, 3]) + _PLACE[3:] + noise * NOISE * rng.normal(size=(poses, 3))
        turns = Rotation.from_rotvec(noise * TURN_NOISE * rng.normal(size=(poses, 3))) * station
        return cls(arm, q, points, turns * Rotation.from_matrix(at[:, :3, :3]))

    def pose_set(self) -> PoseSet:
        """The same poses as flexcal has them."""
        names = np.full(len(self.q), "seen"), np.full(len(self.q), self.arm.model.stations.names[0])
        return PoseSet(
            self.q,
            self.points,
            np.full((len(self.q), 3), NOISE),
            None,
            None,
            *names,
            None,
            np.arange(len(self.q)),
            quaternion_wxyz=self.turns.as_quat()[:, [3, 0, 1, 2]],
            orientation_sigma=np.full(len(self.q), TURN_NOISE),
        )


def run() -> list[tuple[str, float, str]]:
    """Ratios of wall time."""
    return [_full_poses(), _orientations(), _views()]


def _orientations() -> tuple[str, float, str]:
    """Time of a fit of full poses over that of the same points alone, medians of processor time side by side."""
    measured = FullPoses.measured(3)
    model, full = measured.arm.model, measured.pose_set()
    bare, seconds = full.without_orientations(), []
    for _ in range(15):
        for poses in (full, bare):
            began = time.process_time()
            fit_geometry(model, poses, terms=("kinematic",))
            seconds.append(time.process_time() - began)
    with_turns, points = np.median(seconds[::2]), np.median(seconds[1::2])
    note = f"{1e3 * with_turns:.0f} ms against {1e3 * points:.0f} ms of processor time"
    return f"{POSES} full poses over points, {MOST_OVER_POINTS:g} at most", float(with_turns / points), note


def _full_poses() -> tuple[str, float, str]:
    measured = FullPoses.measured(3)
    arm, q, points, turns = measured.arm, measured.q, measured.points, measured.turns
    model, poses, nominal = arm.model, measured.pose_set(), NOMINAL
    start = np.concatenate(
        [_kabsch(np.array([arm.carried(r, nominal)[:3, 3] for r in q]), points), nominal.ravel()]
    )

    def residual(x: np.ndarray) -> np.ndarray:
        errors, seen = x[6:].reshape(7, 6), Rotation.from_rotvec(x[:3])
        left = []
        for row, point, turn in zip(q, points, turns, strict=True):
            reached = arm.carried(row, errors)
            left.append((point - seen.apply(reached[:3, 3]) - x[3:6]) / NOISE)
            left.append(
                (turn * (seen * Rotation.from_matrix(reached[:3, :3])).inv()).as_rotvec() / TURN_NOISE
            )
        return np.concatenate(left)

    peer, peer_seconds = _solved(residual, start)
    seconds, fit = min(
        (timed(lambda: fit_geometry(model, poses, terms=("kinematic",))) for _ in range(3)),
        key=lambda r: r[0],
    )
    note = (
        f"{peer_seconds:.1f} s ({peer.nfev} steps, rms {_rms(peer):.3f} σ) against {1e3 * seconds:.0f} ms "
        f"(chi² {fit.estimate.reduced_chi2:.3f})"
    )
    return f"{POSES} full poses, SciPy, {FASTER:g} wanted", peer_seconds / seconds, note


def _views() -> tuple[str, float, str]:
    with tempfile.TemporaryDirectory() as folder:
        model = _ur5(folder)
        arm, rng = PlainArm(model), np.random.default_rng(4)
        nominal = NOMINAL
        truth = nominal + rng.normal(size=(7, 6)) * [*3 * [5e-4], *3 * [3e-4]]
        first = arm.carried(_BENT, truth)
        turn = Rotation.from_matrix(first[:3, :3])
        board = np.concatenate(
            [turn.as_rotvec(), first[:3, 3] + first[:3, 2] * 0.5 - turn.apply([0.135, 0.105, 0])]
        )
        q, pixels = [], []
        while len(q) < POSES:
            row = _BENT + 0.35 * _SPREAD * rng.uniform(-1, 1, 6)
            seen = _projected(arm.carried(row, truth), board, _CAMERA)
            if seen is not None and ((seen > 0) & (seen < _SIZE)).all():
                q.append(row)
                pixels.append(seen + _PIXEL * rng.normal(size=seen.shape))
        postures, corners = np.array(q), np.array(pixels)
        file = Path(folder) / "views.csv"
        rows = ["pose,q1,q2,q3,q4,q5,q6,corner,u,v"]
        for k in range(POSES):
            for i in range(len(_BOARD)):
                rows.append(",".join(map(repr, [k + 1, *postures[k].tolist(), i, *corners[k, i].tolist()])))
        file.write_text("\n".join(rows) + "\n")

        def residual(x: np.ndarray) -> np.ndarray:
            errors, left = x[15:].reshape(7, 6), []
            for row, found in zip(postures, corners, strict=True):
                seen = _projected(arm.carried(row, errors), x[9:15], x[:9])
                left.append(np.full(found.size, 1e6) if seen is None else ((found - seen) / _PIXEL).ravel())
            return np.concatenate(left)

        # a script starts from a calibrated camera and a board whose place it knows to centimetres
        start = np.concatenate([_CAMERA * 1.01, board + 0.01, nominal.ravel()])
        peer, peer_seconds = _solved(residual, start)
        seconds, fit = timed(lambda: fit_geometry(model, read_poses(file, model), terms=("kinematic",)))
    note = (
        f"{peer_seconds:.1f} s ({peer.nfev} steps, rms {_rms(peer):.3f} σ) against {seconds:.2f} s with reading "
        f"(chi² {fit.estimate.reduced_chi2:.3f})"
    )
    return f"{POSES} views of {len(_BOARD)} corners, SciPy, {FASTER:g} wanted", peer_seconds / seconds, note


def _projected(carried: np.ndarray, board: np.ndarray, lens: np.ndarray) -> np.ndarray | None:
    """Pixels (48, 2) of the board's corners; None where one is behind the camera."""
    corners = Rotation.from_rotvec(board[:3]).apply(_BOARD) + board[3:]
    inside = (corners - carried[:3, 3]) @ carried[:3, :3]
    if inside[:, 2].min() < 0.05:
        return None
    x, y = inside[:, 0] / inside[:, 2], inside[:, 1] / inside[:, 2]
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = lens
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    v = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    return np.column_stack([fx * u + cx, fy * v + cy])


def _ur5(folder: str | None = None) -> RobotModel:
    """The UR5 of the example with the target as `PlainArm` carries it, and a camera where a `folder` for its robot.yaml is given."""
    example = Path(__file__).parent.parent / "examples" / "ur5_tracker"
    model = RobotModel.from_yaml(example / "robot.yaml", estimates=False)
    last = model.joints[-1].link
    board = "{kind: charuco, columns: 9, rows: 7, square: 0.03, marker: 0.022}"
    camera = f"measurements: {{eye: {{kind: camera, size: [1280, 960], board: {board}}}}}\n"
    with tempfile.TemporaryDirectory() as own:
        file = Path(folder or own) / "robot.yaml"
        file.write_text(
            f"robot: {example / 'ur5.urdf'}\npoints: {{seen: {{frame: {last}, xyz: [0.05, 0.03, 0.1]}}}}\n"
            + (camera if folder else "")
        )
        return replace(RobotModel.from_yaml(file), path=file)


def _kabsch(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    turn = Rotation.align_vectors(target - target.mean(axis=0), source - source.mean(axis=0))[0]
    return np.concatenate([turn.as_rotvec(), target.mean(axis=0) - turn.apply(source.mean(axis=0))])


def _solved(residual, start: np.ndarray) -> tuple[OptimizeResult, float]:
    began = time.perf_counter()
    result = least_squares(residual, start, x_scale="jac", method="trf")
    return result, time.perf_counter() - began


def _rms(result: OptimizeResult) -> float:
    return float(np.sqrt(2 * result.cost / (len(result.fun) - np.linalg.matrix_rank(result.jac, tol=1e-4))))


def timed(action):
    """Wall time of an action, s, and what it returns."""
    began = time.perf_counter()
    result = action()
    return time.perf_counter() - began, result
