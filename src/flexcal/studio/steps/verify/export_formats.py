"""Formats that the calibrated robot can be exported in."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import FlexcalError
from flexcal.export import FORMATS
from flexcal.studio.project import CALIBRATION, Project

XACRO = "xacro"
_COMPLETE = ("json", "runtime")
"""Formats of flexcal's own, which carry every model."""


@dataclass(frozen=True)
class ExportFormat:
    """A format.

    Parameters
    ----------
    name : str
        After `flexcal export`.
    summary : str
        What it is, in a line.
    out : str
        File, or folder of xacro files, that is written in the project.
    refusal : str
        Why this robot cannot be exported so; empty where it can.
    """

    name: str
    summary: str
    out: str
    refusal: str = ""

    @property
    def arguments(self) -> tuple[str, ...]:
        """Command line after `flexcal`."""
        return ("export", self.name, "robot.yaml", "--estimates", CALIBRATION, "--out", self.out)

    def written(self, folder: Path) -> list[str]:
        """Names of the files of the format that are in the project's `folder`."""
        place = folder / self.out
        if self.name != XACRO:
            return [self.out] if place.is_file() else []
        return sorted(
            path.relative_to(folder).as_posix()
            for path in place.rglob("*")
            if path.is_file() and not any(part.startswith(".") for part in path.relative_to(folder).parts)
        )


def export_formats(project: Project) -> list[ExportFormat]:
    """All formats, those that do not apply with the reason; raises `FlexcalError` where the calibrated robot cannot be read."""
    from flexcal.jobs.deployment import identified_robot

    robot = identified_robot(project.robot_file, project.folder / CALIBRATION)

    def refusal(name: str) -> str:
        from flexcal.export import render

        try:
            if name == "kinematics":
                render(name, robot.probable, robot.nominal)
            if name == "isaac" and "actuators" not in robot.blocks:
                return "no actuators were identified."
        except FlexcalError as problem:
            return str(problem)
        return ""

    xacro = ExportFormat(
        XACRO, "the robot's URDF with calibrated numbers, every other byte as before", "description"
    )
    return [
        *(ExportFormat(each.name, each.summary, each.example, refusal(each.name)) for each in FORMATS),
        xacro,
    ]


def complete_formats(project: Project) -> list[str]:
    """Names of the formats that carry all that was calibrated; raises `FlexcalError` where the calibrated robot cannot be read."""
    from flexcal.export import render
    from flexcal.jobs.deployment import identified_robot

    robot = identified_robot(project.robot_file, project.folder / CALIBRATION)
    mjcf = render("mjcf", robot.probable, robot.nominal)
    return [*_COMPLETE, *(() if mjcf.unrepresented else ("mjcf",))]
