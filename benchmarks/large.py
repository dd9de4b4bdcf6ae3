"""Every verb that reads poses, targets or logs on a million rows: time, peak memory and size of the page.

`python -m benchmarks.large --rows 100000 1000000 --cases calibrate verify`

Each verb runs in a process of its own whose address space is limited. One that takes too long is stopped, and its memory until
then is told. The robots are those of the examples; poses and logs are made here from their models with changed parameters and noise.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import functools
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from flexcal.data.experiments import labels
from flexcal.data.plans import MultisinePlan, write_plan
from flexcal.data.recordings import Recording, write_recording
from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.files.formats import write_estimates
from flexcal.frequency.periodic import excitation_torque, reference_trajectory
from flexcal.model.robot import Links, RobotModel, carried_inertias
from flexcal.model.statics import tool_at_rest
from flexcal.model.torques import inertial_parameters, torque_regressor

EXAMPLES = Path(__file__).parents[1] / "examples"
ROWS = (100_000, 1_000_000)
LIMIT_GB, PAGE_MB, ADDRESS_GB, SECONDS = 2.0, 10.0, 6, 900
VISITS = 1000
"""Of one pose, where poses are visited again."""
_PLACES = 20
"""Fewest poses."""
RATE_HZ = 1000.0
_FITTED, _BLOCK = 200, 50_000
_ARMS = {"rigid": "ur5_tracker", "elastic": "tx90l"}
_SIGMA = 5e-5
_WATCH = """
import os, resource, subprocess, sys, time
limit = int(sys.argv[1]) * 2**30
def limited(): resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
begun = time.perf_counter()
with open(sys.argv[2], "wb") as log:
    process = subprocess.Popen(sys.argv[4:], stdout=log, stderr=log, preexec_fn=limited)
    status = os.waitpid(process.pid, os.WNOHANG)
    while status[0] == 0 and time.perf_counter() - begun < float(sys.argv[3]):
        time.sleep(0.05)
        status = os.waitpid(process.pid, os.WNOHANG)
    if status[0] == 0:
        process.kill()
        status = os.waitpid(process.pid, 0)
usage = resource.getrusage(resource.RUSAGE_CHILDREN)
print(time.perf_counter() - begun, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, status[1])
"""
"""Run by a process of its own, as a child's peak memory begins with that of its parent."""


@dataclass(frozen=True)
class Case:
    """A verb whose `arguments` name files of a folder, which `prepare` makes with so many rows; `page` is the report that it writes."""

    prepare: Callable[[Path, int], None]
    arguments: tuple[str, ...]
    page: str | None = None


@dataclass(frozen=True)
class Measured:
    """One run: wall and processor time (s), peak memory (bytes), the page's size, exit status and the last line it printed."""

    seconds: float
    processor: float
    memory: float
    page: float
    status: int
    said: str


def run() -> Iterator[tuple[str, float, str]]:
    """2 GB over the peak memory of every verb."""
    for name, rows, found in collect(list(CASES), ROWS):
        yield f"{name}, {rows} rows", LIMIT_GB * 1e9 / found.memory, described(found)


def collect(names: Sequence[str], rows: Sequence[int]) -> Iterator[tuple[str, int, Measured]]:
    """Every case with every number of rows, one at a time."""
    for name in names:
        for count in rows:
            with tempfile.TemporaryDirectory(prefix="flexcal_large_") as folder:
                yield name, count, measured(CASES[name], Path(folder), count)


def measured(case: Case, folder: Path, rows: int) -> Measured:
    """One case in an empty folder."""
    case.prepare(folder, rows)
    program = [sys.executable, "-m", "flexcal.cli.main", *case.arguments]
    watch = [sys.executable, "-c", _WATCH, str(ADDRESS_GB), str(folder / "said.txt"), str(SECONDS), *program]
    found = subprocess.run(watch, cwd=folder, check=True, capture_output=True, text=True)
    seconds, processor, memory, status = (float(value) for value in found.stdout.split())
    page = (
        0.0 if case.page is None or not (folder / case.page).exists() else (folder / case.page).stat().st_size
    )
    lines = [line for line in (folder / "said.txt").read_text(errors="replace").splitlines() if line.strip()]
    return Measured(seconds, processor, memory, page, int(status), lines[-1] if lines else "")


def described(found: Measured) -> str:
    """In words."""
    page = f", page {found.page / 1e6:.1f} MB" if found.page else ""
    ended = "" if found.status == 0 else f"; ended with status {found.status}: {found.said}"
    return f"{found.memory / 1e9:.2f} GB, {found.seconds:.0f} s ({found.processor:.0f} s of a processor){page}{ended}"


def _arm(folder: Path, kind: str) -> RobotModel:
    """A copy of the example in the folder; the model is the true arm."""
    source = EXAMPLES / _ARMS[kind]
    for file in source.iterdir():
        if file.suffix in (".yaml", ".urdf"):
            shutil.copy(file, folder)
    nominal = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    rng = np.random.default_rng(1)
    wrong = {f"{joint}.offset": 2e-3 * rng.standard_normal() for joint in nominal.joint_names}
    wrong |= {f"{joint}.length_x": 3e-4 * rng.standard_normal() for joint in nominal.joint_names[1:]}
    return nominal.with_values(wrong)


def _configurations(arm: RobotModel, rows: int, seed: int) -> np.ndarray:
    lower, upper = np.array([(max(j.lower, -2.5), min(j.upper, 2.5)) for j in arm.joints]).T
    return np.random.default_rng(seed).uniform(0.9 * lower, 0.9 * upper, (rows, arm.n))


def _points(arm: RobotModel, q: np.ndarray, seed: int) -> np.ndarray:
    """Measured positions (N, 3)."""
    name = next(iter(arm.points))
    parts = [
        tool_at_rest(arm, part, None, np.full(len(part), name)).kinematics.position
        for part in np.array_split(q, max(1, len(q) // _BLOCK))
    ]
    return np.concatenate(parts) + _SIGMA * np.random.default_rng(seed).standard_normal((len(q), 3))


def _write(
    path: Path, pose: np.ndarray, q: np.ndarray, xyz: np.ndarray | None = None, **more: np.ndarray
) -> None:
    columns = {"pose": pose} | {f"q{j + 1}": q[:, j] for j in range(q.shape[1])}
    if xyz is not None:
        columns |= dict(zip("xyz", xyz.T, strict=True))
    pl.DataFrame(columns | more).write_csv(path, float_precision=9)


def _poses(
    folder: Path, rows: int, *, kind: str = "rigid", visits: int = 1, name: str = "poses.csv", seed: int = 2
) -> None:
    arm = _arm(folder, kind)
    pose = np.arange(rows) // min(visits, max(1, rows // _PLACES))
    q = _configurations(arm, int(pose[-1]) + 1, seed)[pose]
    noise = 3e-5 * np.random.default_rng(seed + 1).standard_normal(q.shape) if visits > 1 else 0.0
    xyz = _points(arm, q + noise, seed + 2)
    _write(folder / name, pose, q, xyz, sigma=np.full(rows, _SIGMA))


def _after_stage_one(folder: Path, rows: int) -> None:
    """Poses of an elastic arm, and a stage 1 that found its springs 2 % too stiff, with standard deviations of 3 %."""
    _poses(folder, rows, kind="elastic")
    arm = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    springs = [name for name in arm.values if name.endswith(".stiffness")]
    found = Parameters(Parameter(name, "N m/rad", 1.02 * arm.value(name), scale="log") for name in springs)
    count = len(springs)
    known = (True,) * count
    stage_one = Estimate(found, 0.03**2 * np.eye(count), count, (), known, 0.0, 0.0, 0, "converged", "", 0)
    write_estimates(folder / arm.config.estimates, "stiffness", stage_one)


def _calibrated(folder: Path, rows: int, *, kind: str = "rigid") -> None:
    """Poses, and a calibration on a few others."""
    _poses(folder, _FITTED, kind=kind, name="fitted.csv", seed=12)
    _flexcal(folder, "calibrate", "robot.yaml", "fitted.csv")
    _poses(folder, rows, kind=kind)


def _commands(folder: Path, rows: int, *, kind: str = "rigid") -> None:
    _calibrated(folder, _FITTED, kind=kind)
    arm = _arm(folder, kind)
    _write(folder / "targets.csv", np.arange(rows), _configurations(arm, rows, 2))


def _certified(folder: Path, rows: int) -> None:
    """Targets, and both measurements."""
    _commands(folder, rows)
    arm = _arm(folder, "rigid")
    q = _configurations(arm, rows, 2)
    _write(folder / "before.csv", np.arange(rows), q, _points(arm, q, 3), sigma=np.full(rows, _SIGMA))
    nominal = RobotModel.from_yaml(folder / "robot.yaml", estimates=False)
    xyz = _points(nominal, q, 4)
    _write(folder / "after.csv", np.arange(rows), q, xyz, sigma=np.full(rows, _SIGMA))


def _compared(folder: Path, rows: int) -> None:
    """Two folders of a verification."""
    _calibrated(folder, rows)
    _flexcal(folder, "verify", "robot.yaml", "poses.csv", "--out", "one")
    _flexcal(folder, "verify", "robot.yaml", "poses.csv", "--out", "other")


def _reported(folder: Path, rows: int) -> None:
    _calibrated(folder, rows)
    _flexcal(folder, "verify", "robot.yaml", "poses.csv", "--out", "out")


def _log(folder: Path, rows: int, *, held: Sequence[float] = ()) -> None:
    """The TX90L on sums of sines: one log, or one with each payload, declared in a column."""
    arm = _arm(folder, "elastic")
    for number, payload in enumerate(held or (None,)):
        count = rows // max(1, len(held))
        with (folder / f"log_{number + 1}.csv").open("wb") as stream:
            for first in range(0, count, _BLOCK):
                part = np.arange(first, min(first + _BLOCK, count))
                _motion(arm, part, payload).write_csv(stream, include_header=first == 0, float_precision=9)


def _responses(folder: Path, rows: int) -> None:
    """Three joints of the TX90L as free inertias, excited by a multisine: rows of all recordings together."""
    arm = _arm(folder, "elastic")
    lines = np.arange(5, 245, 4)
    recordings, rate, base = 24, RATE_HZ, 0.2
    plan = MultisinePlan(
        name="large",
        poses=np.full((1, arm.n), 0.3),
        joints=(0, 1, 2),
        payload=0.0,
        base_frequency_hz=base,
        lines=lines,
        amplitude=np.full((3, len(lines)), 2.0),
        periods=max(3, round(rows / recordings * base / rate)),
        settle_periods=1,
        realisations=4,
        signs=True,
        reference_amplitude=0.02,
        reference_frequency_hz=10.5 * base,
        kp=np.full(arm.n, 1000.0),
        kd=np.full(arm.n, 100.0),
        rate_hz=rate,
        torque="instantaneous",
        seed=1,
    )
    (folder / "frequency").mkdir()
    samples = round(rate / base)
    omega = 2 * np.pi * base * np.arange(1, samples // 2 + 1)
    rng = np.random.default_rng(5)
    for label in labels(plan):
        torque = excitation_torque(plan, label.realisation, label.experiment, label.sign)
        swing = np.fft.rfft(torque, axis=0)
        swing[1:] /= -(omega**2)[:, None] * np.array([40.0, 30.0, 10.0])
        swing[0] = 0.0
        count = samples * plan.periods
        q, tau = np.tile(plan.poses[0], (count, 1)), np.zeros((count, arm.n))
        q[:, :3] += np.tile(np.fft.irfft(swing, samples, axis=0), (plan.periods, 1))
        q[:, :3] += reference_trajectory(plan, np.arange(count) / rate)[0][:, None]
        tau[:, :3] += np.tile(torque, (plan.periods, 1))
        q += 1e-6 * rng.standard_normal(q.shape)
        tau += 0.1 * rng.standard_normal(tau.shape)
        write_recording(
            folder / "frequency" / f"{label.name}.csv", Recording(time_step=1 / rate, q=q, torque=tau)
        )
    write_plan(folder / "frequency" / "plan.yaml", plan)


def _motion(arm: RobotModel, number: np.ndarray, payload: float | None) -> pl.DataFrame:
    rng = np.random.default_rng(7)
    rate = 2 * np.pi * 0.1 * np.array([1, 2, 3, 5, 7])
    size, phase = 0.25 * rng.normal(size=(5, arm.n)), rng.uniform(0, 2 * np.pi, (5, arm.n))
    angle = (number / RATE_HZ)[:, None, None] * rate[:, None] + phase
    q = np.sum(size * np.sin(angle), axis=1)
    dq = np.sum(size * rate[:, None] * np.cos(angle), axis=1)
    ddq = -np.sum(size * rate[:, None] ** 2 * np.sin(angle), axis=1)
    loaded = arm if payload is None else _holding(arm, payload)
    torque = torque_regressor(loaded, q, dq, ddq) @ inertial_parameters(loaded)
    torque += arm.drives.rotor_inertia * ddq + arm.drives.viscous * dq + arm.drives.coulomb * np.sign(dq)
    noise = np.random.default_rng(int(number[0])).normal(size=torque.shape)
    torque += 5e-3 * np.array([joint.effort for joint in arm.joints]) * noise
    columns = {"t": number / RATE_HZ} | {f"q{j + 1}": q[:, j] for j in range(arm.n)}
    columns |= {f"tau{j + 1}": torque[:, j] for j in range(arm.n)}
    return pl.DataFrame(columns if payload is None else columns | {"payload": np.full(len(number), payload)})


def _holding(arm: RobotModel, payload: float) -> RobotModel:
    bodies = carried_inertias(arm, payload)
    return replace(arm, links=Links.of(bodies))


def _flexcal(folder: Path, *arguments: str) -> None:
    subprocess.run(
        [sys.executable, "-m", "flexcal.cli.main", *arguments], cwd=folder, check=True, capture_output=True
    )


_elastic = functools.partial(_poses, kind="elastic")
_OUT = ("--out", "out")
CASES: dict[str, Case] = {
    "calibrate": Case(_poses, ("calibrate", "robot.yaml", "poses.csv", *_OUT), "out/report.html"),
    "calibrate elastic": Case(_elastic, ("calibrate", "robot.yaml", "poses.csv", *_OUT), "out/report.html"),
    "calibrate after stage 1": Case(
        _after_stage_one, ("calibrate", "robot.yaml", "poses.csv", *_OUT), "out/report.html"
    ),
    "calibrate visits": Case(
        functools.partial(_poses, visits=VISITS),
        ("calibrate", "robot.yaml", "poses.csv", *_OUT),
        "out/report.html",
    ),
    "verify": Case(_calibrated, ("verify", "robot.yaml", "poses.csv", *_OUT), "out/report.html"),
    "verify elastic": Case(
        functools.partial(_calibrated, kind="elastic"),
        ("verify", "robot.yaml", "poses.csv", *_OUT),
        "out/report.html",
    ),
    "predict": Case(_commands, ("predict", "robot.yaml", "targets.csv", "--out", "tool.csv")),
    "predict elastic": Case(
        functools.partial(_commands, kind="elastic"),
        ("predict", "robot.yaml", "targets.csv", "--out", "tool.csv"),
    ),
    "compensate": Case(_commands, ("compensate", "robot.yaml", "targets.csv", "--out", "commands.csv")),
    "compensate elastic": Case(
        functools.partial(_commands, kind="elastic"),
        ("compensate", "robot.yaml", "targets.csv", "--out", "commands.csv"),
    ),
    "map": Case(
        _commands, ("map", "robot.yaml", "--working", "targets.csv", "--out", "map.html"), "map.html"
    ),
    "next poses": Case(
        _calibrated,
        ("design", "poses", "robot.yaml", "--measured", "poses.csv", "--out", "next.yaml"),
        "next.html",
    ),
    "poses from a file": Case(
        _commands,
        ("design", "poses", "robot.yaml", "--from", "targets.csv", "--out", "next.yaml"),
        "next.html",
    ),
    "repeatability": Case(
        functools.partial(_poses, visits=VISITS),
        ("repeatability", "robot.yaml", "poses.csv", *_OUT),
        "out/report.html",
    ),
    "certificate": Case(
        _certified,
        (
            "certificate",
            "robot.yaml",
            "--targets",
            "targets.csv",
            "--before",
            "before.csv",
            "--after",
            "after.csv",
        ),
        "certificate.html",
    ),
    "report": Case(_reported, ("report", "out"), "out/report.html"),
    "compare": Case(_compared, ("report", "one", "--compare", "other"), "one/comparison.html"),
    "identify dynamics": Case(
        functools.partial(_log, held=(0.0,)),
        ("identify", "dynamics", "robot.yaml", "log_1.csv", *_OUT),
        "out/report.html",
    ),
    **{
        f"identify dynamics, {name}": Case(
            functools.partial(_log, held=(0.0,)),
            ("identify", "dynamics", "robot.yaml", "log_1.csv", "--estimator", name, *_OUT),
            "out/report.html",
        )
        for name in ("sdp", "irls", "iv", "didim", "energy", "power", "tls", "ml", "ekf")
    },
    "learn residual": Case(
        functools.partial(_log, held=(0.0,)),
        ("identify", "dynamics", "robot.yaml", "log_1.csv", "--learn-residual", *_OUT),
        "out/report.html",
    ),
    "identify payload": Case(
        functools.partial(_log, held=(0.0, 6.0)),
        ("identify", "payload", "robot.yaml", "log_2.csv", "--free", "log_1.csv", *_OUT),
        "out/report.html",
    ),
    "identify response": Case(
        _responses, ("identify", "response", "robot.yaml", "frequency", *_OUT), "out/report.html"
    ),
    "identify gains": Case(
        functools.partial(_log, held=(0.0, 6.0)),
        ("identify", "gains", "robot.yaml", "log_1.csv", "log_2.csv", *_OUT),
        "out/report.html",
    ),
}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", nargs="+", type=int, default=list(ROWS))
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    given = parser.parse_args()
    for case, count, found in collect(given.cases, given.rows):
        print(
            f"{case:25s} {count:8d}   {described(found)}   flexcal {' '.join(CASES[case].arguments)}",
            flush=True,
        )
