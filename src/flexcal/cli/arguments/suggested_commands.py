"""Next steps that several verbs print."""

from __future__ import annotations

from os.path import relpath
from pathlib import Path
from typing import TYPE_CHECKING

from flexcal.errors import InputError
from flexcal.files.transaction import read_text
from flexcal.printable import quoted

if TYPE_CHECKING:
    from flexcal.model.robot import RobotModel


def measure_command(plan: Path, robot: Path, folder: str) -> str:
    """The command line that carries out a plan in the virtual cell."""
    return f"flexcal measure {quoted(plan)}{robot_option(plan, robot)} --cell virtual --out {quoted(folder)}"


def export_command(plan: Path, robot: Path) -> str:
    """The command line that writes the signals of a frequency plan for a real robot."""
    return f"flexcal export excitation {quoted(plan)}{robot_option(plan, robot)} --out excitation"


def robot_option(plan: Path, robot: Path) -> str:
    """The option --robot where a verb would not find the robot of a plan by itself."""
    from flexcal.jobs.inputs import robot_file

    try:
        near = robot_file(plan, None).samefile(robot)
    except InputError:
        near = False
    return "" if near else f" --robot {quoted(robot)}"


def import_command(robot: Path, poses: str) -> str:
    """The other way to measure poses, where the robot is a real one."""
    return f"; or measure them on the robot, and flexcal import {quoted(robot)} FILE --out {quoted(poses)}"


def estimates_option(place: Path | None) -> str:
    """The option by which another verb finds estimates that are not beside robot.yaml; empty where they are."""
    return "" if place is None else f" --estimates {quoted(place)}"


def temperature_option(celsius: float | None) -> str:
    """The option by which another verb takes the same temperature of the arm; empty where none was given."""
    return "" if celsius is None else f" --temperature {celsius:g}"


def after_dynamics(robot: Path, model: RobotModel, loaded: str) -> str:
    """Next commands after the robot's own dynamics: the payload by `loaded`, if one is declared and not identified, and springs or
    poses.
    """
    springs = f"flexcal design frequency {quoted(robot)} --out frequency.yaml"
    poses = f"flexcal design poses {quoted(robot)} --count 40 --out poses.yaml"
    onward = springs if model.elastic else poses
    if model.payload is None:
        return onward
    return f"{loaded}; or, where the declared payload is weighed, {onward}"


def estimates_entry_hint(robot: Path, estimates: Path) -> str:
    """Hint on how other verbs find estimates that are not beside robot.yaml."""
    entry = f"'estimates: {relpath(estimates, robot.parent)}'"
    line = next((i for i, text in enumerate(_lines(robot), start=1) if text.startswith("estimates:")), None)
    if line is None:
        return f"for other verbs to use these estimates, add the line {entry} to {robot}"
    return f"for other verbs to use these estimates, replace the line {line} of {robot} by {entry}"


def stored_lines(robot: Path, estimates: Path | None, out: Path | None) -> tuple[str, ...]:
    """Lines on the files with the estimates and, in the folder `out`, the report; and on how other verbs find estimates there."""
    if estimates is None:
        return ()
    if out is None:
        return (f"wrote {estimates}",)
    return f"wrote {estimates}", f"wrote {out / 'report.html'}", estimates_entry_hint(robot, estimates)


def _lines(file: Path) -> list[str]:
    return read_text(file).splitlines()
