"""Comparison of the joint ranges of a calibration with those of its use."""

from __future__ import annotations

import numpy as np

from flexcal.jobs.inputs import PREDICTED, CalibratedRobot, beyond_calibration, beyond_remark
from flexcal.model.robot import RobotModel

_BEYOND = 0.1
"""Share of a calibrated joint range by which a pose may lie outside it."""
_FEW = 0.05
"""Share of poses outside below which no remark is made."""


def joint_extents(model: RobotModel, q: np.ndarray) -> dict[str, tuple[float, float]]:
    """Lowest and highest position of every joint over poses `q` (N, n), rad or m."""
    lowest, highest = q.min(axis=0).tolist(), q.max(axis=0).tolist()
    return dict(zip(model.motor_names, zip(lowest, highest, strict=True), strict=True))


def outside_ranges(calibrated: CalibratedRobot, q: np.ndarray) -> str:
    """Remark on poses `q` (N, n) where the calibration does not hold: by predicted errors, or its joint ranges where it has none; empty if
    there are hardly any.
    """
    if PREDICTED in calibrated.blocks["calibration"].ranges:
        return "".join(beyond_remark(calibrated, beyond_calibration(calibrated, q), "poses"))
    ranges, model = calibrated.blocks["calibration"].ranges, calibrated.model
    known = [name for name in model.motor_names if name in ranges]
    if not known:
        return ""
    low, high = np.array([ranges[name] for name in known]).T
    columns = q[:, [model.motor_names.index(name) for name in known]]
    slack = _BEYOND * (high - low)
    outside = (columns < low - slack) | (columns > high + slack)
    share = float(outside.any(axis=1).mean())
    if share <= _FEW:
        return ""
    worst = int(np.argmax(outside.mean(axis=0)))
    name = known[worst]
    revolute = model.joints[model.joint_index(name)].kind == "revolute"

    def told(a: float, b: float) -> str:
        return f"{np.degrees(a):.0f}° to {np.degrees(b):.0f}°" if revolute else f"{a:.3f} to {b:.3f} m"

    here = told(float(columns[:, worst].min()), float(columns[:, worst].max()))
    there = told(low[worst], high[worst])
    return (
        f"{100 * share:.0f} % of the poses lie outside the joint ranges of the calibration ({name}: calibrated {there}, here {here}), so "
        "its accuracy there is extrapolated; calibrate on poses of the working volume"
    )
