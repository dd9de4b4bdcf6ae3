"""True parameters of a hard robot that have a name in the identified model."""

from __future__ import annotations

import numpy as np

from flexcal.hard_cell.drawn import HardRobot

MILLIRADIAN = 1e-3
_SPRINGS = ("bearing_x", "bearing_y", "drive")


def counterparts(robot: HardRobot) -> dict[str, float]:
    """True values, SI, of link masses and centres of mass, rotor inertias, springs, dampers, hardening and half gaps, by parameter name.

    Springs of the wrist are among them, which stage 1 may find. The rest of the robot, above all its geometry, has other parameters than
    the model and can be judged by measured points alone.
    """
    arm, values = robot.arm, {}
    for j, k in enumerate(arm.joints):
        link = arm.links[k]
        values[f"{link.name}.mass"] = link.mass
        values |= {f"{link.name}.com_{axis}": float(x) for axis, x in zip("xyz", link.com, strict=True)}
        values[f"{link.joint}.rotor_inertia"] = float(arm.rotor_inertia[j])
        for component in np.flatnonzero(np.isfinite(arm.springs[j])):
            values[f"{link.joint}.{_SPRINGS[component]}.stiffness"] = float(arm.springs[j, component])
            values[f"{link.joint}.{_SPRINGS[component]}.damping"] = float(arm.dampers[j, component])
        if np.isfinite(arm.springs[j, 2]):
            values[f"{link.joint}.drive.hardening"] = float(robot.hardening[j, 2]) * MILLIRADIAN**2
        if j in arm.gaps:
            values[f"{link.joint}.backlash"] = float(robot.gap[j])
    return values
