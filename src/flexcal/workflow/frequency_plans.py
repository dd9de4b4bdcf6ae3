"""The frequency experiments of the demonstration: six informative poses with a payload, or the paper's three without."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.data.joint_limits import check_joint_limits
from flexcal.data.table import open_table
from flexcal.elasticity.gap import multisine_torque
from flexcal.errors import InputError
from flexcal.frequency.multisine import half_integer_frequency, odd_lines
from flexcal.model import RobotModel, static_equilibrium
from flexcal.units import DEGREE

BASE_FREQUENCY_HZ = 0.25
BAND_HZ = (3.0, 80.0)
EXCITATION = 0.04
"""Largest root mean square of the excitation of an axis in one experiment, relative to its drive's effort."""
_CREST = 3.0
"""Peak of a multisine's torque over its root mean square."""
_LEAST = 0.5
"""What is left of the excitation at least: a drive that gravity does not load crosses its gap however small that is."""
DROOP = 2 * DEGREE
"""How far an excited axis may stray from its reference: under gravity, which the soft loop holds imperfectly, and by the excitation."""


def frequency_plan(
    model: RobotModel, poses_file: Path, kind: Literal["default", "paper"], seed: int
) -> MultisinePlan:
    """The plan `default` (payload as declared, 1.5° reference at 2.125 Hz) or `paper` (no payload, 3°); P1 §4.1.3, Fig. 4.

    Odd lines from 3 to 80 Hz on f0 = 0.25 Hz, flat amplitudes, four realisations of four periods, two of them dropped, both signs. The
    excitation is lowered, on all axes alike, until its peaks no longer pull a drive with backlash across its gap against gravity.
    Raises `InputError` where the file lacks the plan's poses, robot.yaml a controller, or a pose the room that the motion about it needs.
    """
    if model.controller is None:
        raise InputError(
            f"{model.path} declares no controller; add `controller: {{kp: […], kd: […], rate_hz: 4000}}`."
        )
    lines = odd_lines(BASE_FREQUENCY_HZ, *BAND_HZ)
    joints = tuple(e.index for e in model.elastic)
    efforts = np.array([model.joints[i].effort for i in joints])
    amplitude = EXCITATION * efforts * np.sqrt(2 * len(joints) / len(lines))
    reference = (1.5 if kind == "default" else 3.0) * DEGREE
    room = np.zeros(model.n)
    room[list(joints)] = reference + DROOP
    plan = MultisinePlan(
        name=kind,
        poses=read_frequency_poses(poses_file, kind, model, room),
        joints=joints,
        payload=None if kind == "default" else 0.0,
        base_frequency_hz=BASE_FREQUENCY_HZ,
        lines=lines,
        amplitude=np.repeat(amplitude[:, None], len(lines), axis=1),
        periods=4,
        settle_periods=2,
        realisations=4,
        signs=True,
        reference_amplitude=reference,
        reference_frequency_hz=half_integer_frequency(BASE_FREQUENCY_HZ, 2.125),
        kp=np.array(model.controller.kp),
        kd=np.array(model.controller.kd),
        rate_hz=model.controller.rate_hz,
        torque="held",
        seed=seed,
    )
    return replace(plan, amplitude=_preloaded_share(model, plan) * plan.amplitude)


def _preloaded_share(model: RobotModel, plan: MultisinePlan) -> float:
    """The share of the excitation at which its peaks in every pose stay below what gravity puts on the drives with backlash."""
    drives = [k for k, i in enumerate(plan.joints) if i in model.backlash_joints]
    held = np.abs(static_equilibrium(model, plan.poses, plan.payload).torque[:, list(plan.joints)])
    swing = _CREST * np.array([multisine_torque(model, q, plan.payload, plan) for q in plan.poses])
    return float(np.clip((held / swing)[:, drives].min(initial=1.0), _LEAST, 1.0))


def read_frequency_poses(
    path: Path, kind: str, model: RobotModel, room: np.ndarray | float = 0.0
) -> np.ndarray:
    """Poses (P, n) in rad of one plan from a table with columns plan, pose, q1_deg … qn_deg.

    Raises `InputError` with file, line and column for what does not fit and for a joint with less than `room` (n,) rad to its limits.
    """
    file = open_table(path)
    columns = [f"q{i}_deg" for i in range(1, model.n + 1)]
    if file.columns != ("plan", "pose", *columns):
        raise file.error(
            f"the columns are {', '.join(file.columns)}, but for {model.path} they must be plan, pose, {', '.join(columns)}."
        )
    table = file.read(("plan", "pose"))
    rows = np.flatnonzero(table.columns["plan"] == kind)
    if not len(rows):
        raise InputError(f"{path}: there is no pose of the plan '{kind}'.")
    poses = np.stack([table.columns[column] for column in columns], axis=1)[rows] * DEGREE
    check_joint_limits(model, table, rows, columns, poses, room)
    return poses
