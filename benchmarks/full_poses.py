"""Calibration on full poses against figaroh's on the same ones: errors at fresh poses of the same robots, and wall time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.peers import run_peer
from benchmarks.plain_least_squares import NOISE, TURN_NOISE, FullPoses, timed
from flexcal.calibration.fit import fit_geometry
from flexcal.calibration.measurement import predict_measurements

URDF = Path(__file__).parent.parent / "examples" / "ur5_tracker" / "ur5.urdf"
POSES, FRESH, ROBOTS = 60, 100, 3


def run() -> list[tuple[str, float, str]]:
    """Ratios figaroh to flexcal of the errors at fresh poses and of wall time, means over the robots."""
    peers, ours, seconds = [], [], []
    for seed in range(ROBOTS):
        measured, fresh = (
            FullPoses.measured(seed, POSES),
            FullPoses.measured(seed, FRESH, noisy=False, draw=1),
        )
        model, poses = measured.arm.model, measured.pose_set()
        request = {
            "urdf": str(URDF),
            "frame": model.joints[-1].link,
            "q": measured.q.tolist(),
            "points": measured.points.tolist(),
            "turns": measured.turns.as_matrix().tolist(),
            "fresh": fresh.q.tolist(),
            "noise": NOISE,
            "turn_noise": TURN_NOISE,
        }
        peer = run_peer("figaroh_calibration.py", ("figaroh==1.0.2",), request)
        own, fit = timed(lambda model=model, poses=poses: fit_geometry(model, poses, terms=("kinematic",)))
        peers.append(_errors(fresh, np.array(peer["points"]), Rotation.from_matrix(np.array(peer["turns"]))))
        at = predict_measurements(fit.model, fresh.pose_set(), elastic=False)
        ours.append(_errors(fresh, at.position, Rotation.from_matrix(at.orientation)))
        seconds.append((peer["seconds"], own))
    (theirs_at, theirs_turned), (at, turned) = np.mean(peers, axis=0), np.mean(ours, axis=0)
    peer_seconds, own_seconds = np.mean(seconds, axis=0)
    return [
        (
            f"error of the position, {POSES} full poses, figaroh, 1 wanted",
            theirs_at / at,
            f"rms {1e6 * theirs_at:.2f} against {1e6 * at:.2f} µm at {FRESH} fresh poses of {ROBOTS} robots",
        ),
        (
            f"error of the orientation, {POSES} full poses, figaroh, 1 wanted",
            theirs_turned / turned,
            f"rms {1e6 * theirs_turned:.1f} against {1e6 * turned:.1f} µrad",
        ),
        (
            f"time, {POSES} full poses, figaroh",
            peer_seconds / own_seconds,
            f"{peer_seconds:.1f} s against {1e3 * own_seconds:.0f} ms",
        ),
    ]


def _errors(fresh: FullPoses, points: np.ndarray, turns: Rotation) -> tuple[float, float]:
    """Root mean square distance, m, and angle, rad, from the true poses."""
    angle = (turns * fresh.turns.inv()).magnitude()
    away = np.linalg.norm(points - fresh.points, axis=1)
    return float(np.sqrt(np.mean(away**2))), float(np.sqrt(np.mean(angle**2)))
