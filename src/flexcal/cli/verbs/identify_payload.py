"""`flexcal identify payload`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Accept,
    EstimatesFolder,
    Jobs,
    Json,
    MaybePath,
    Paths,
    Robot,
    file_argument,
    require_robot_and_files,
)
from flexcal.cli.arguments.suggested_commands import estimates_option, stored_lines
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted

if TYPE_CHECKING:
    from flexcal.jobs.payload import PayloadIdentification


@dataclass(frozen=True)
class IdentifyPayload:
    """Identify mass, centre of mass and inertia of the payload from joint logs of motion with it.

    The robot's own dynamics are those of its estimates ('identify dynamics' or 'identify inertials'), or of --free recordings. Friction is
    estimated again. Writes the block `payload` of estimates.yaml beside robot.yaml, which 'compensate', 'predict', 'calibrate', 'verify'
    and 'export' use from then on. The torques must be in N m: with currents times gains, a relative error of the gains is one of the mass.
    """

    robot: Robot
    logs: Annotated[
        Positional[Paths],
        file_argument("LOGS...", "joint logs (CSV or Parquet) with the payload, or the folder of 'measure'"),
    ]
    free: Annotated[Paths, arg(metavar="LOG...", help_behavior_hint="")] = ()
    """Joint logs without the payload; not those from which the estimates were identified."""
    frame: Annotated[
        str,
        arg(metavar="FRAME", help_behavior_hint="(default: as robot.yaml declares it, else the last link)"),
    ] = ""
    """URDF frame of the values."""
    estimates: Annotated[
        MaybePath,
        arg(
            metavar="FILE",
            help="estimates.yaml of the robot's own dynamics, or the folder of 'identify dynamics --out'; "
            "without --out the block payload is added to it.",
            help_behavior_hint="(default: beside robot.yaml)",
        ),
    ] = None
    accept: Accept = ()
    jobs: Jobs = 1
    out: EstimatesFolder = None
    json: Json = False

    def run(self) -> None:
        """Fit, and print the payload."""
        from flexcal.cli.tables.results import quantity_table
        from flexcal.jobs.logs import preprocessing_remarks
        from flexcal.jobs.payload import identify_robot_payload

        require_robot_and_files(self.robot, self.logs, "LOGS")
        console = Console(self.json)
        with console.progress() as progress:
            payload = identify_robot_payload(
                self.robot,
                self.logs,
                free=self.free,
                frame=self.frame,
                estimates=self.estimates,
                accept_weight="weight" in self.accept,
                out=self.out,
                command=command_line(),
                jobs=self.jobs,
                progress=progress,
            )
        document = payload.document()
        units = {item.name: item.unit for item in payload.estimate.parameters}
        title = f"payload in the frame {payload.frame}, inertia about its centre of mass"
        console.show(quantity_table(title, document["parameters"], units))
        console.say(f"relative torque error: {document['error_percent']['train']:.2f} %")
        for sentence in preprocessing_remarks(document["signals"]):
            console.say(sentence)
        for remark in document["remarks"]:
            console.say(remark)
        console.say(payload.trust.sentence)
        console.say(f"as a line of robot.yaml: {payload.declaration}")
        for line in stored_lines(self.robot, payload.estimates, self.out):
            console.say(line)
        console.finish(document, self._next(payload))

    def _next(self, payload: PayloadIdentification) -> str:
        where = estimates_option(self.out or self.estimates)
        if "calibration" in payload.blocks:
            return f"flexcal compensate {quoted(self.robot)} targets.csv{where} --out commands.csv"
        if payload.declared.elastic and "stiffness" not in payload.blocks:
            return f"flexcal design frequency {quoted(self.robot)} --out frequency.yaml"
        return f"flexcal design poses {quoted(self.robot)} --count 40 --out poses.yaml"
