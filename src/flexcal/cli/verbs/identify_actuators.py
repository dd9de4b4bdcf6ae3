"""`flexcal identify actuators`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from tyro.conf import Positional

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    EstimatesFolder,
    Jobs,
    Json,
    Paths,
    Robot,
    file_argument,
    require_robot_and_files,
)
from flexcal.cli.arguments.suggested_commands import estimates_option, stored_lines
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError
from flexcal.printable import quoted


@dataclass(frozen=True)
class IdentifyActuators:
    """Identify gains, delay, friction and armature of position-controlled joints, so that a simulator moves like the robot.

    Commanded and measured joint positions suffice (columns qc1… and q1…). The robot is simulated in MuJoCo over short windows of the logs;
    all torques are relative to the masses of the links. Writes the block `actuators` of estimates.yaml beside robot.yaml, for
    export mjcf.
    """

    robot: Robot
    logs: Annotated[
        Positional[Paths],
        file_argument("LOGS...", "logs of commanded and measured joint positions (CSV or Parquet)"),
    ]
    damping: Literal["velocity", "error"] = "velocity"
    """What the controller damps: the velocity, or its difference from the commanded velocity."""
    known_gains: bool = False
    """Take the gains kp and kd under `controller:` of robot.yaml (N m/rad, N m s/rad) as known."""
    hold_out: float = 0.25
    """Last share of every log that is simulated without having been fitted."""
    jobs: Jobs = 1
    out: EstimatesFolder = None
    json: Json = False

    def run(self) -> None:
        """Fit, and print the parameters and how much the simulation misses."""
        from flexcal.cli.tables.results import quantity_table
        from flexcal.jobs.actuators import identify_robot_actuators

        require_robot_and_files(self.robot, self.logs, "LOGS")
        if not 0.05 <= self.hold_out <= 0.9:
            raise InputError(
                "E-CLI-043",
                f"--hold-out is a share between 0.05 and 0.9, not {self.hold_out:g}; give another.",
            )
        console = Console(self.json)
        with console.progress() as progress:
            found = identify_robot_actuators(
                self.robot,
                self.logs,
                damping=self.damping,
                known_gains=self.known_gains,
                hold_out=self.hold_out,
                out=self.out,
                command=command_line(),
                jobs=self.jobs,
                progress=progress,
            )
        document = found.document()
        units = {item.name: item.unit for item in found.estimate.parameters}
        console.show(quantity_table("actuators", document["parameters"], units))
        console.say(found.headline)
        for sentence in (*found.remarks, found.trust.sentence):
            console.say(sentence)
        for line in stored_lines(self.robot, found.estimates, self.out):
            console.say(line)
        console.finish(
            document,
            f"flexcal export mjcf {quoted(self.robot)}{estimates_option(self.out)} --out calibrated.xml",
        )
