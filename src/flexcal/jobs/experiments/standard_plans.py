"""Default plans of frequency experiments: six poses with a payload, or the paper's three without."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.data.tables import check_joint_limits, open_table
from flexcal.design.frequency import excitation_margin, flat_multisine, static_amplitude_share
from flexcal.errors import InputError
from flexcal.model.robot import RobotModel
from flexcal.units import DEGREE

REFERENCE = {"default": 1.5 * DEGREE, "paper": 3.0 * DEGREE}
"""Amplitude of the reference motion, rad."""
_LEAST = 0.5
"""Least excitation that remains: a drive without gravity load crosses its gap, however small."""


def reference_amplitude(kind: str) -> float:
    """Amplitude of the reference motion of a plan, rad."""
    return REFERENCE.get(kind, REFERENCE["default"])


def frequency_plan(
    model: RobotModel, poses_file: str | Path, kind: Literal["default", "paper"], seed: int
) -> MultisinePlan:
    """Standard plan of frequency experiments in the poses of a file (Neubauer et al. 2015, section 4.1.3); see `standard_plan`.

    Parameters
    ----------
    model : RobotModel
        Robot with elastic joints and a controller.
    poses_file : str or Path
        Table with the columns plan, pose, q1_deg … qn_deg.
    kind : {"default", "paper"}
        Which rows of the table are taken, and their payload and reference motion: as declared and 1.5°, or none and 3°.
    seed : int
        Seed of the random phases.

    Returns
    -------
    MultisinePlan
        Odd lines from 3 to 80 Hz on 0.25 Hz, with flat amplitudes.

    Raises
    ------
    InputError
        Where the file lacks the plan's poses, robot.yaml a controller, or a pose the room that the motion about it needs.

    Examples
    --------
    >>> from flexcal import RobotModel, frequency_plan
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> plan = frequency_plan(model, "examples/tx90l/frequency_poses.csv", "default", seed=0)
    >>> plan.poses.shape, plan.frequencies_hz.shape
    ((6, 6), (154,))
    """
    room = excitation_margin(model, reference_amplitude(kind))
    return standard_plan(model, read_frequency_poses(poses_file, kind, model, room), kind, seed)


def standard_plan(
    model: RobotModel, poses: np.ndarray, kind: Literal["default", "paper"], seed: int
) -> MultisinePlan:
    """Plan `default` (payload as declared, 1.5° reference at 2.125 Hz) or `paper` (no payload, 3°) in `poses` (P, n), rad.

    Neubauer et al. 2015, §4.1.3, Fig. 4. Odd lines from 3 to 80 Hz on f0 = 0.25 Hz, flat amplitudes, four realisations of four periods, two
    of them dropped, both signs. The excitation is lowered, on all axes alike, until its peaks no longer pull a drive with backlash
    across its gap against gravity. Raises `FlexcalError` where robot.yaml declares no controller.
    """
    payload = None if kind == "default" else 0.0
    plan = flat_multisine(
        model, poses, name=kind, payload=payload, reference=reference_amplitude(kind), seed=seed
    )
    share = float(np.clip(static_amplitude_share(model, plan), _LEAST, 1.0))
    return replace(plan, amplitude=share * plan.amplitude)


def read_frequency_poses(
    path: str | Path, kind: str, model: RobotModel, room: np.ndarray | float = 0.0
) -> np.ndarray:
    """Poses (P, n) in rad of one plan from a table with columns plan, pose, q1_deg … qn_deg.

    Raises `InputError` with file, line and column for what does not fit and for a joint with less than `room` (n,) rad to its limits.
    """
    file = open_table(path)
    columns = [f"q{i}_deg" for i in range(1, model.n + 1)]
    if file.columns != ("plan", "pose", *columns):
        raise file.error(
            "E-RUN-041",
            f"the columns are {', '.join(file.columns)}, but for {model.path} they must be plan, pose, {', '.join(columns)}.",
        )
    table = file.read(("plan", "pose"))
    rows = np.flatnonzero(table.columns["plan"] == kind)
    if not len(rows):
        raise InputError("E-RUN-042", f"{path}: there is no pose of the plan '{kind}'.")
    poses = np.stack([table.columns[column] for column in columns], axis=1)[rows] * DEGREE
    check_joint_limits(model, table, rows, columns, poses, room)
    return poses
