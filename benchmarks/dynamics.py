"""Logs to base parameters with intervals, against a Pinocchio loop with NumPy's lstsq and against figaroh; processor time and peak memory.

From motions to the estimate all do the same; the peers build one dense matrix of all joints' rows, which a long log does not allow, so they
are timed on a short one, by the sample. Whole processes read the file, too. figaroh runs in an environment of its own.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin

from benchmarks.peers import PeerAbsentError, run_peer
from flexcal.data.recordings import Decimation, Recording, write_recording
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.regression import assemble_regression
from flexcal.dynamics.signals import JointLog, Motion
from flexcal.model.robot import RobotModel

EXAMPLE = Path(__file__).parents[1] / "examples" / "tx40"
SAMPLES, SHORT, RATE_HZ, CUTOFF_HZ = 1_000_000, 10_000, 1000.0, 50.0
RUNS = 3
NOISE = np.array([3.0, 2.0, 1.0, 0.3, 0.2, 0.05])
_WATCH = """
import os, subprocess, sys
process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
_, status, usage = os.wait4(process.pid, 0)
print(usage.ru_utime + usage.ru_stime, usage.ru_maxrss)
sys.exit(status != 0)
"""
"""Run by a process of its own, as a child's peak memory begins with that of its parent."""
MICROSECONDS, MEGABYTES = 4.0, 300.0
TX40_SECONDS, TX40_MEGABYTES = 0.8, 250.0


def run() -> list[tuple[str, float, str]]:
    """Limit over measured, and the peer's time over ours."""
    observation = Observation(RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False), CLASSIC)
    base = BaseParameters.of(observation)
    results = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(EXAMPLE / "tx40.urdf", folder)
        swing = motion(observation, np.arange(SHORT))
        write_recording(folder / "log.parquet", long_log(observation))
        log = JointLog.read(folder / "log.parquet", observation.model, CUTOFF_HZ, folder)
        peer, undecimated, decimated = best_times(
            lambda: dense(observation, swing),
            lambda: weighted_least_squares(assemble_regression(observation, base, [log], Decimation(1))),
            lambda: weighted_least_squares(assemble_regression(observation, base, [log], Decimation(10))),
        )
        peer *= 1e6 / SHORT
        figaroh, how = _figaroh(swing)
        for factor, seconds in ((1, undecimated), (10, decimated)):
            ours = seconds / SAMPLES * 1e6
            label = f"1e6 samples, decimated by {factor}"
            results += [
                (f"{label}: Pinocchio loop, dense lstsq", peer / ours, f"{peer:.1f} µs a sample, ours {ours:.2f}"),
                (f"{label}: figaroh, regressor to double QR", figaroh / ours, how),
                (f"{label}: limit {MICROSECONDS:g} µs a sample", MICROSECONDS / ours, f"{ours:.2f} µs"),
            ]  # fmt: skip
            robot = folder / f"decimated_by_{factor}.yaml"
            text = (EXAMPLE / "robot.yaml").read_text().partition("signals:")[0]
            declared = f"cutoff_hz: {CUTOFF_HZ:g}, decimation: {factor}, friction: classic"
            robot.write_text(text.replace("cutoff_hz: 100, decimation: 100", declared))
            seconds, megabytes = _identified(robot, folder / "log.parquet")
            results.append(
                (
                    f"{label}: limit {MEGABYTES:g} MB",
                    MEGABYTES / megabytes,
                    f"{megabytes:.0f} MB and {seconds:.1f} s from file to intervals, whole process",
                )
            )
        robot = Path(shutil.copytree(EXAMPLE, folder / "example")) / "robot.yaml"
        robot.write_text(robot.read_text().replace("decimation: 100", "decimation: 100, friction: classic"))
        seconds, megabytes = _identified(robot, EXAMPLE / "exciting.parquet")
        results += [
            (
                f"TX40 file, limit {TX40_SECONDS} s",
                TX40_SECONDS / seconds,
                f"{seconds:.2f} s of one processor, whole process",
            ),
            (f"TX40 file, limit {TX40_MEGABYTES:g} MB", TX40_MEGABYTES / megabytes, f"{megabytes:.0f} MB"),
        ]
    return results


def motion(observation: Observation, number: np.ndarray) -> Motion:
    """Samples of that number of a motion on sums of sines, with the torques of unit friction and noise."""
    rng = np.random.default_rng(7)
    rate = 2 * np.pi * 0.1 * np.array([1, 2, 3, 5, 7])
    size, phase = rng.normal(size=(5, 6)), rng.uniform(0, 2 * np.pi, (5, 6))
    angle = (number / RATE_HZ)[:, None, None] * rate[:, None] + phase
    q = np.sum(size * np.sin(angle), axis=1)
    dq = np.sum(size * rate[:, None] * np.cos(angle), axis=1)
    ddq = -np.sum(size * rate[:, None] ** 2 * np.sin(angle), axis=1)
    still = Motion(number / RATE_HZ, q, dq, ddq, np.zeros_like(q))
    x = np.where(observation.values() == 0, 1.0, observation.values())
    columns = observation.columns(still)
    torque = np.stack([x[m] @ c for m, c in zip(observation.column_indices, columns, strict=True)], axis=1)
    torque += NOISE * np.random.default_rng(int(number[0])).normal(size=torque.shape)
    return Motion(still.time, q, dq, ddq, torque)


def long_log(observation: Observation) -> Recording:
    """A thousand seconds of it."""
    parts = [motion(observation, np.arange(a, a + SHORT)) for a in range(0, SAMPLES, SHORT)]
    whole = Motion.joined(parts)
    return Recording(time_step=1 / RATE_HZ, q=whole.q, torque=whole.torque)


def dense(observation: Observation, swing: Motion) -> np.ndarray:
    """As one writes it first: Pinocchio's regressor sample by sample, drive columns beside it, one least-squares solution."""
    model = pin.buildModelFromUrdf(str(EXAMPLE / "tx40.urdf"))
    data = model.createData()
    n, inertial = observation.model.n, 10 * observation.model.n
    matrix = np.zeros((len(swing), n, len(observation.names)))
    for k in range(len(swing)):
        matrix[k, :, :inertial] = pin.computeJointTorqueRegressor(
            model, data, swing.q[k], swing.dq[k], swing.ddq[k]
        )
    for term in observation.terms:
        for column in term.columns(observation.model, swing, {}):
            matrix[:, column.joint, observation.names.index(column.name)] = column.values
    return np.linalg.lstsq(matrix.reshape(-1, matrix.shape[2]), swing.torque.ravel(), rcond=None)[0]


def _figaroh(swing: Motion) -> tuple[float, str]:
    """µs a sample of its regressor, elimination and double QR, and in words; NaN where it cannot be installed."""
    rows = {key: getattr(swing, key).tolist() for key in ("q", "dq", "ddq", "torque")}
    try:
        found = run_peer("figaroh_fit.py", ("figaroh==1.0.2",), {"urdf": str(EXAMPLE / "tx40.urdf"), **rows})
    except PeerAbsentError as absent:
        return float("nan"), f"skipped: {absent}"
    each = found["seconds"] * 1e6 / len(swing)
    return each, f"{each:.1f} µs a sample, {found['rank']} base parameters"


def _identified(robot: Path, log: Path) -> tuple[float, float]:
    """Seconds of one processor and peak megabytes of `flexcal identify dynamics` as a process, start-up included; the fastest of some.

    The modules are compiled, as they are where flexcal is installed.
    """
    command = [sys.executable, "-m", "flexcal.cli.main", "identify", "dynamics", str(robot), str(log)]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}

    def once() -> tuple[float, float]:
        (robot.parent / "estimates.yaml").unlink(missing_ok=True)
        watched = subprocess.run(
            [sys.executable, "-c", _WATCH, *command],
            check=True,
            capture_output=True,
            text=True,
            env=environment,
        )
        seconds, kilobytes = watched.stdout.split()
        return float(seconds), float(kilobytes) / 1024

    return min(once() for _ in range(RUNS))


def best_times(*works: Callable[[], object]) -> list[float]:
    """The shortest processor time of each, s, taken by turns, as the machine is not always equally fast."""
    rounds = []
    for _ in range(RUNS):
        rounds.append([])
        for work in works:
            started = time.process_time()
            work()
            rounds[-1].append(time.process_time() - started)
    return [min(times) for times in zip(*rounds, strict=True)]
