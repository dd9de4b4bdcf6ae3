"""The frequency experiments of the demonstration: six informative poses with a payload, or the paper's three without."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Literal

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.errors import InputError
from flexcal.frequency.multisine import half_integer_frequency, odd_lines
from flexcal.model import RobotModel
from flexcal.units import DEGREE

BASE_FREQUENCY_HZ = 0.25
BAND_HZ = (3.0, 80.0)
EXCITATION = 0.04
"""Root mean square of the excitation of an axis in one experiment, relative to its drive's effort."""


def frequency_plan(
    model: RobotModel, poses_file: Path, kind: Literal["default", "paper"], seed: int
) -> MultisinePlan:
    """The plan `default` (payload as declared, 1.5° reference at 2.125 Hz) or `paper` (no payload, 3°); P1 §4.1.3, Fig. 4.

    Odd lines from 3 to 80 Hz on f0 = 0.25 Hz, flat amplitudes, four realisations of four periods, two of them dropped, both signs.
    Raises `InputError` where the file lacks the plan's poses, or robot.yaml a controller.
    """
    if model.controller is None:
        raise InputError(
            f"{model.path} declares no controller; add `controller: {{kp: […], kd: […], rate_hz: 4000}}`."
        )
    lines = odd_lines(BASE_FREQUENCY_HZ, *BAND_HZ)
    joints = tuple(e.index for e in model.elastic)
    efforts = np.array([model.joints[i].effort for i in joints])
    amplitude = EXCITATION * efforts * np.sqrt(2 * len(joints) / len(lines))
    return MultisinePlan(
        name=kind,
        poses=read_frequency_poses(poses_file, kind, model.n),
        joints=joints,
        payload=None if kind == "default" else 0.0,
        base_frequency_hz=BASE_FREQUENCY_HZ,
        lines=lines,
        amplitude=np.repeat(amplitude[:, None], len(lines), axis=1),
        periods=4,
        settle_periods=2,
        realisations=4,
        signs=True,
        reference_amplitude=(1.5 if kind == "default" else 3.0) * DEGREE,
        reference_frequency_hz=half_integer_frequency(BASE_FREQUENCY_HZ, 2.125),
        kp=np.array(model.controller.kp),
        kd=np.array(model.controller.kd),
        rate_hz=model.controller.rate_hz,
        torque="held",
        seed=seed,
    )


def read_frequency_poses(path: Path, kind: str, joints: int) -> np.ndarray:
    """Poses (P, n) in rad of one plan from a file with columns plan, pose, q1_deg … qn_deg; raises `InputError`."""
    try:
        with path.open(newline="") as stream:
            rows = [row for row in csv.DictReader(stream) if row.get("plan") == kind]
        poses = np.array([[float(row[f"q{i}_deg"]) for i in range(1, joints + 1)] for row in rows])
    except (OSError, KeyError, ValueError) as problem:
        raise InputError(
            f"{path}: no poses can be read ({problem}); columns plan, pose, q1_deg … q{joints}_deg are needed."
        ) from problem
    if not len(poses):
        raise InputError(f"{path}: there is no pose of the plan '{kind}'.")
    return poses * DEGREE
