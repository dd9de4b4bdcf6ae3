"""Files of an arm of LeRobot: the calibration of its motors, and recordings in ticks."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from cheap_arm import TICK, CheapArm
from cli_files import read_csv

JOINTS = ("pan", "lift", "elbow", "flex", "roll")
MOTORS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
SIGNS = np.array([1, -1, 1, 1, -1])
ZEROS = np.deg2rad([0, 90, 0, 0, 0])
"""Angles of the URDF's joints at the motors' middles."""
RANGES = ((700, 3300), (790, 3310), (820, 3080), (850, 3211), (0, 4095))


def calibration_file(path: Path) -> Path:
    """As LeRobot writes it, with a gripper that is no joint of the URDF."""
    ranges = (*RANGES, (2030, 3500))
    document = {
        name: {"id": k, "drive_mode": 0, "homing_offset": 17 * k - 50, "range_min": low, "range_max": high}
        for k, (name, (low, high)) in enumerate(zip((*MOTORS, "gripper"), ranges, strict=True), 1)
    }
    path.write_text(json.dumps(document, indent=4))
    return path


def ticks_of(q: np.ndarray) -> np.ndarray:
    """Ticks (N, 5) of the motors where the old calibration says that the joints are at `q`."""
    middles = np.array([(low + high) / 2 for low, high in RANGES])
    return middles + SIGNS * (q - ZEROS) / TICK


def record(arm: CheapArm, path: Path, count: int, seed: int) -> np.ndarray:
    """A recording of motors and marker, mm; returns the joint positions by the old calibration."""
    rng = np.random.default_rng(seed)
    q = arm.postures(count, rng)
    poses = arm.write_poses(path.with_suffix(".poses.csv"), q, rng)
    header, rows = read_csv(poses)
    places = 1e3 * rows[:, [header.index(axis) for axis in "xyz"]]
    lines = [",".join([*(f"{name}.pos" for name in MOTORS), "x_mm", "y_mm", "z_mm"])]
    lines += [
        ",".join(repr(float(v)) for v in row)
        for row in np.hstack([np.round(ticks_of(q), 1), places]).tolist()
    ]
    path.write_text("\n".join(lines) + "\n")
    return q
