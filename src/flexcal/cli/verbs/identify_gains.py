"""`flexcal identify gains`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Jobs,
    Json,
    MaybePath,
    Paths,
    Robot,
    file_argument,
    require_robot_and_files,
)
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted


@dataclass(frozen=True)
class IdentifyGains:
    """Identify the drive gain (N m/A) of each joint, from recordings with and without the payload of robot.yaml.

    A column `payload` of every log states the mass held in kg. This mass must be right; centre of mass and inertia are fitted.
    robot.yaml is not changed: copy the printed line into its `signals: tau:`.
    """

    robot: Robot
    logs: Annotated[
        Positional[Paths],
        file_argument("LOGS...", "joint logs (CSV or Parquet), with and without payload"),
    ]
    jobs: Jobs = 1
    out: Annotated[MaybePath, arg(metavar="DIR", help_behavior_hint="(default: none)")] = None
    """Folder for report.html and results.json."""
    json: Json = False

    def run(self) -> None:
        """Fit, and print the gains."""
        from flexcal.cli.tables.results import drive_gain_table
        from flexcal.jobs.gains import identify_robot_gains
        from flexcal.jobs.logs import preprocessing_remarks

        require_robot_and_files(self.robot, self.logs, "LOGS")
        console = Console(self.json)
        with console.progress() as progress:
            gains = identify_robot_gains(
                self.robot, self.logs, out=self.out, command=command_line(), jobs=self.jobs, progress=progress
            )
        document = gains.document()
        console.show(drive_gain_table(document["parameters"], document["declared_gains"]))
        for sentence in preprocessing_remarks(document["signals"]):
            console.say(sentence)
        console.say(f"signals: {{tau: {{gain: [{', '.join(f'{gain:.5g}' for gain in gains.gains)}]}}}}")
        console.say(gains.trust.sentence)
        if self.out is not None:
            console.say(f"wrote {self.out / 'report.html'}")
        console.finish(document, f"flexcal identify dynamics {quoted(self.robot)} {quoted(self.logs[0])}")
