"""Creation of a robot.yaml for a URDF, to be completed by hand."""

from __future__ import annotations

import json
import math
import re
from contextlib import suppress
from dataclasses import dataclass
from os.path import relpath
from pathlib import Path
from typing import Any

from flexcal.errors import InputError
from flexcal.files.transaction import write_text
from flexcal.model.parts import Joint
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import Arm, find_arm
from flexcal.printable import quoted
from flexcal.units import DEGREE

_PLAIN = re.compile(r"[A-Za-z_./][\w./ -]*")
_NO_TEXT = {"true", "false", "null", "yes", "no", "on", "off"}


@dataclass(frozen=True)
class InitialisedRobot:
    """Written robot.yaml, the robot that it describes, and remarks on the URDF."""

    file: Path
    model: RobotModel
    arm: Arm
    remarks: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "file": self.file,
            "robot": self.model.name,
            "joints": list(self.model.motor_names),
            "locked": self.arm.locked,
            "frame": self.arm.frame,
            "frames": list(self.arm.frames),
            "reach_m": self.model.reach,
            "remarks": list(self.remarks),
        }


def init_robot(urdf: Path, out: Path, *, tip: str | None = None) -> InitialisedRobot:
    """Write `out`/robot.yaml for a URDF, read it back, and check masses and collision shapes.

    Raises `InputError` as `find_arm` and reading a robot do, and then where there is a robot.yaml already; nothing is written then.
    """
    arm = find_arm(urdf, tip)
    file = out / "robot.yaml"
    if file.exists():
        raise InputError(
            "E-RUN-091",
            f"{file} is there already and stays as it is: go on with 'flexcal design poses {quoted(file)} --out "
            f"{quoted(out / 'poses.yaml')}', with measurements at hand with 'flexcal import {quoted(file)} FILE', "
            f"or give --out DIR for a new one of {urdf}.",
        )
    made = [folder for folder in (out, *out.parents) if not folder.exists()]
    link = relpath(urdf, out)
    write_text(file, _minimal(link, arm))
    try:
        model = RobotModel.from_yaml(file, estimates=False)
        write_text(file, _commented(link, arm, model))
        model = RobotModel.from_yaml(file, estimates=False)
        return InitialisedRobot(file, model, arm, tuple(_remarks(model)))
    except BaseException:
        file.unlink(missing_ok=True)
        for folder in made:
            with suppress(OSError):
                folder.rmdir()
        raise


def _minimal(urdf: str, arm: Arm) -> str:
    return f"robot: {_text(urdf)}\n{_locked(arm)}{_motors(arm)}"


def _motors(arm: Arm) -> str:
    return f"motors: [{', '.join(map(_text, arm.motors))}]\n" if arm.motors else ""


def _locked(arm: Arm) -> str:
    if not arm.locked:
        return ""
    listed = ", ".join(f"{_text(name)}: {value:.10g}" for name, value in arm.locked.items())
    return f"locked: {{{listed}}}\n"


def _commented(urdf: str, arm: Arm, model: RobotModel) -> str:
    n = model.n
    width = max(len(name) for name in model.joint_names)
    rows = [
        f"#   q{i:<3}{joint.name:<{width}}  {_range(joint)}" for i, joint in enumerate(model.motor_joints, 1)
    ]
    rows += [
        f"#   –   {joint.name:<{width}}  follows others"
        for i, joint in enumerate(model.joints)
        if i not in model.motors
    ]
    order = f"\n# Their order is a guess from their names: check it.\n{_motors(arm)}" if arm.motors else ""
    others = f"; also on it: {', '.join(arm.frames[1:])}" if arm.frames[1:] else ""
    zeros, gains = ", ".join(["0"] * n), ", ".join(["1.0"] * n)
    turning = [joint.name for joint in model.motor_joints if joint.kind != "prismatic"]
    sliding = [joint.name for joint in model.motor_joints if joint.kind == "prismatic"]
    first = _text((turning or sliding)[min(1, len(turning or sliding) - 1)])
    per = "m" if not turning else "rad"
    force = "N" if not turning else "N m"
    amplifier = f"{force}/A at the joint" + (" (N/A where it slides)" if turning and sliding else "")
    also = f"; of {', '.join(map(_text, sliding))}: kg, N s/m, N" if turning and sliding else ""
    columns = ", ".join(f"J{i}" for i in range(1, n + 1))
    locked = f"\n# Movable joints that are no part of the arm stand still, here (rad or m):\n{_locked(arm)}"
    return f"""# {model.name}: {n} joints. Units are m, rad, kg, s, N m. Complete `points:` before you measure; all else may wait.
robot: {_text(urdf)}

# The joints, in the order of the columns q1 … q{n} of every file:
{chr(10).join(rows)}
{locked if arm.locked else ""}{order}
# What the instrument sees: the centre of the reflector, m along the axes of a frame of the URDF. {_text(arm.frame)} was guessed
# from its name{others}. Measure xyz with a ruler, to a centimetre or so: the calibration finds the rest,
# and 'flexcal import' and 'flexcal calibrate' write what they find here with --write-point.
# Off the last joint's axis (by 0.1 m, say) it also shows how far that joint turns.
points:
  smr: {{frame: {_text(arm.frame)}, xyz: [0.0, 0.0, 0.0]}}

gravity: [0, 0, -9.81]         # in the robot's base frame; turn it for a robot on a wall or a ceiling

# What the robot holds while it is measured: kg, its centre of mass in the frame, m, and 1σ of the mass, kg.
# payload: {{frame: {_text(arm.frame)}, mass: 5.0, com: [0.0, 0.0, 0.1], mass_std: 0.02}}

# Where the instrument stands, m in the base frame, to plan poses that it sees.
# stations: {{tracker: {{xyz: [3.0, 0.0, 1.0], line_of_sight: true}}}}

# Where the robot will work, m in the base frame: poses are chosen for it.
# working_volume: {{lower: [0.3, -0.4, 0.1], upper: [0.8, 0.4, 0.7]}}

# Joints with backlash, to have it found from the measured points.
# geometry: {{terms: auto, backlash: [{first}]}}

# Drives, referred to the joint, one number a joint: {"kg m², N m s/rad, N m" if turning else "kg, N s/m, N"}{also}.
# drives:
#   rotor_inertia: [{zeros}]
#   viscous: [{zeros}]
#   coulomb: [{zeros}]

# Elastic joints, for the frequency experiments: a first guess of stiffness ({force}/{per}) and damping ({force} s/{per}).
# elastic:
#   - joint: {first}
#     drive: {{stiffness: 1.0e5, damping: 100}}
# bearings: after     # their axes turn with the child link; before: they are fixed to the parent link

# Only for files that are read as they are; 'flexcal import' makes files in the usual columns and units instead.
# signals:
#   q: {{columns: [{columns}], {_position_unit(model)}
#   tau: {{columns: [{columns.replace("J", "I")}], unit: A, gain: [{gains}]}}     # {amplifier}
"""


def _position_unit(model: RobotModel) -> str:
    """Remainder of the line of q under `signals:`: one unit if all joints are of one type, else a factor to rad or m for every joint."""
    slides = [joint.kind == "prismatic" for joint in model.motor_joints]
    if all(slides):
        return "unit: mm}"
    if not any(slides):
        return "unit: deg}"
    factors = ", ".join("0.001" if slide else f"{DEGREE:.10g}" for slide in slides)
    return f"gain: [{factors}]}}     # from deg, and from mm of what slides"


def _range(joint: Joint) -> str:
    if not math.isfinite(joint.upper - joint.lower):
        return f"{joint.kind}, without limits"
    if joint.kind == "prismatic":
        return f"prismatic, {joint.lower:.4g} to {joint.upper:.4g} m"
    degrees = f"{joint.lower / DEGREE:.4g} to {joint.upper / DEGREE:.4g} deg"
    return f"{joint.kind}, {joint.lower:.4g} to {joint.upper:.4g} rad ({degrees})"


def _text(name: str) -> str:
    """Name as a YAML scalar, quoted if needed."""
    plain = _PLAIN.fullmatch(name) and name.strip() == name and name.lower() not in _NO_TEXT
    return name if plain else json.dumps(name, ensure_ascii=False)


def _remarks(model: RobotModel) -> list[str]:
    from flexcal.design.scene import CollisionChecker

    remarks = []
    massless = [
        joint.link for joint, mass in zip(model.joints, model.links.mass, strict=True) if not mass > 0
    ]
    if massless:
        remarks.append(
            f"the URDF gives no mass to what {', '.join(massless)} carries: deflection under its weight cannot be computed"
        )
    try:
        checker = CollisionChecker(model, floor=None)
    except InputError as problem:
        remarks.append(
            f"{problem} Until then 'design poses' cannot exclude self-collision, and stops".replace("\n", " ")
        )
        return remarks
    if not checker.shapes:
        remarks.append("the URDF has no collision shapes: 'design poses' cannot exclude self-collision")
    return remarks
