"""Time of single calls of the C++ runtime, and of the same work by the library in Python, one target at a time and in a batch."""

from __future__ import annotations

import re
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from flexcal.compensation import motor_commands
from flexcal.data.poses import ToolTargets
from flexcal.dynamics.torque_model import TorqueModel
from flexcal.export import render_runtime
from flexcal.model.kinematics import joint_ranges
from flexcal.model.robot import GEOMETRY, RobotModel

ROOT = Path(__file__).parent.parent
CALLS = 1_000_000
SINGLE, BATCH = 100, 20_000
ROBOTS = ("tx90l", "ur5_tracker", "panda_sockets")


def run() -> Iterator[tuple[str, float, str]]:
    """Ratios to the runtime's mean time of a command, and the runtime's distribution of times, in microseconds."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "timing"
        source, headers = ROOT / "runtime" / "examples" / "timing.cpp", ROOT / "runtime" / "include"
        subprocess.run(["g++", "-std=c++17", "-O2", f"-I{headers}", source, "-o", program], check=True)
        for robot in ROBOTS:
            nominal = RobotModel.from_yaml(ROOT / "examples" / robot / "robot.yaml", estimates=False)
            real = _disturbed(nominal)
            file = Path(folder) / f"{robot}.json"
            file.write_text(render_runtime(real, nominal, TorqueModel.of(real).document()).text)
            said = subprocess.run(
                [program, file, str(CALLS)], check=True, capture_output=True, text=True
            ).stdout.splitlines()
            for line in said[:3]:
                yield f"{robot}: {line[:20].strip()}", np.nan, line[20:].strip()
            ours = float(re.findall(r"median ([\d.]+)", said[3])[0])
            yield f"{robot}: {said[3][:20].strip()}", 1.0, said[3][20:].strip()
            for label, count, rows in (("one by one", SINGLE, 1), ("in a batch", BATCH, BATCH)):
                theirs = _library(real, nominal, count, rows)
                yield f"{robot}: library, {label}", theirs / ours, f"{theirs:.1f} us a command"


def _disturbed(nominal: RobotModel) -> RobotModel:
    rng = np.random.default_rng(5)
    values = {
        f"{joint}.{key}": (3e-4 if "length" in key else 5e-4) * rng.normal()
        for joint in nominal.joint_names
        for key in GEOMETRY
    }
    return nominal.with_values(values)


def _library(real: RobotModel, nominal: RobotModel, count: int, rows: int) -> float:
    """Microseconds of a command, of `count` of them, `rows` in a call."""
    q = np.random.default_rng(6).uniform(*joint_ranges(nominal), (count, nominal.n))
    point = np.full(rows, nominal.point().name)
    begun = time.perf_counter()
    for first in range(0, count, rows):
        motor_commands(real, nominal, ToolTargets(np.arange(rows), point, q[first : first + rows]))
    return 1e6 * (time.perf_counter() - begun) / count
