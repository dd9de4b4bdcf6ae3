"""`flexcal export urdf`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flexcal.cli.console import Console
from flexcal.cli.options import Estimates, Json, Robot, require_robot


@dataclass(frozen=True)
class ExportUrdf:
    """Write the calibrated robot as URDF: joint origins and tool moved to where they were found to be, links with identified inertials.

    A URDF cannot hold deflection, backlash and transmission error; what leaving them out costs is said in millimetres. Rotor inertia
    and friction stay in estimates.yaml.
    """

    robot: Robot
    out: Annotated[Path, arg(metavar="FILE")]
    """The URDF to write."""
    estimates: Estimates = None
    json: Json = False

    def run(self) -> None:
        """Export, and say what is lost."""
        from flexcal.workflow.export_robot import export_urdf

        require_robot(self.robot)
        console = Console(self.json)
        found = export_urdf(self.robot, self.out, estimates=self.estimates)
        console.say(f"wrote {found.export}")
        following = f"load {self.out} wherever the nominal URDF was loaded"
        if not found.calibrated:
            console.say("there are no estimates: this is the nominal robot")
            following = f"flexcal calibrate {self.robot} POSES…, and export again"
        console.finish(found.document(), following)
