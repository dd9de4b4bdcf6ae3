"""`flexcal identify inertials`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import EstimatesFolder, Json, Robot, require_robot
from flexcal.cli.arguments.suggested_commands import after_dynamics, stored_lines
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted


@dataclass(frozen=True)
class IdentifyInertials:
    """Identify masses, centres of mass, rotor inertias and friction from recordings of 'design trajectory', with CAD as the prior.

    Writes estimates.yaml beside robot.yaml, which 'identify stiffness' and 'calibrate' then use. What the torques do not determine
    keeps the uncertainty of the `prior:` of robot.yaml; springs and geometry have their uncertainty before identification.
    """

    robot: Robot
    folder: Annotated[
        Positional[Path], arg(metavar="DIR", help="folder with plan.yaml and one joint log per trajectory")
    ]
    out: EstimatesFolder = None
    json: Json = False

    def run(self) -> None:
        """Fit, and print the parameters and the error of the torques."""
        from flexcal.cli.tables.results import quantity_table
        from flexcal.jobs.inertials import identify_robot_inertials

        require_robot(self.robot, self.folder)
        console = Console(self.json)
        with console.progress() as progress:
            inertials = identify_robot_inertials(
                self.robot, self.folder, out=self.out, command=command_line(), progress=progress
            )
        document = inertials.document()
        units = {item.name: item.unit for item in inertials.estimate.parameters}
        console.show(quantity_table("links and drives", document["parameters"], units))
        error = document["error_percent"]
        console.say(
            f"relative torque error: {error['train']:.2f} % in the fit, {error['nominal']:.2f} % with the values of robot.yaml"
        )
        console.say(inertials.trust.sentence)
        for line in stored_lines(self.robot, inertials.estimates, self.out):
            console.say(line)
        loaded = (
            f"flexcal design trajectory {quoted(self.robot)} --loaded --out holding.yaml, for the payload"
        )
        console.finish(document, after_dynamics(self.robot, inertials.nominal, loaded))
