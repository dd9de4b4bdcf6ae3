"""`flexcal export excitation`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from flexcal.cli.arguments.shared_options import Between, Folder, Json, MaybeNumber, MaybePath
from flexcal.cli.arguments.suggested_commands import robot_option
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted


@dataclass(frozen=True)
class ExportExcitation:
    """Write the signals of a frequency plan as files that a robot's controller plays: one file per pose, realisation, experiment and sign.

    Columns t, q1…, dq1… (reference of the motors) and tau1… (torque to add to the controller's), joint side, from rest to rest: soft start,
    all periods, soft stop. manifest.csv lists the files with the measured part of each, moves.csv the moves from pose to pose, phases.csv
    amplitude and phase of every line; plan.yaml is the plan as it is played.

    Nothing is written where a signal would pass a limit of the robot: of positions, velocities and torques of the joints, of the tool in
    robot.yaml, and, in drives with backlash, of the load by gravity that keeps the gap closed.
    """

    plan: Annotated[Positional[Path], arg(metavar="PLAN", help="the plan of 'design frequency' (YAML)")]
    out: Annotated[Folder, arg(help="Folder for the files.")]
    rate: Annotated[
        MaybeNumber, arg(metavar="HZ", help_behavior_hint="(default: the plan's)"), Between(1, 20_000)
    ] = None
    """Rate of the controller that plays the files."""
    scale: Annotated[float, arg(metavar="FACTOR"), Between(1e-3, 100)] = 1.0
    """Factor on all amplitudes of the excitation."""
    bandwidth: Annotated[
        MaybeNumber,
        arg(metavar="HZ", help_behavior_hint="(default: the robot takes torques)"),
        Between(0.01, 1000),
    ] = None
    """For a robot that takes positions alone: assumed bandwidth of its controller. The multisine is added to the reference, so that the
    controller makes the plan's torques of it; files have no tau1…."""
    whole: bool = False
    """Write the whole signal, not one period of it to be repeated."""
    format: Literal["csv", "parquet", "ros", "mcap"] = "csv"
    """Format of signals and moves; ros and mcap: trajectory_msgs/JointTrajectory as YAML or in MCAP files, whole, with effort."""
    robot: Annotated[
        MaybePath,
        arg(metavar="ROBOT", help_behavior_hint="(default: beside PLAN, else in the current folder)"),
    ] = None
    """robot.yaml."""
    json: Json = False

    def run(self) -> None:
        """Export, and print what to do with the files."""
        from flexcal.jobs.experiments import export_excitation
        from flexcal.jobs.inputs import robot_file

        console = Console(self.json)
        robot = robot_file(self.plan, self.robot)
        with console.progress() as progress:
            exported = export_excitation(
                self.plan,
                self.out,
                robot=robot,
                rate_hz=self.rate,
                scale=self.scale,
                bandwidth_hz=self.bandwidth,
                whole=self.whole,
                format=self.format,
                progress=progress,
            )
        document, plan = exported.document(), self.out / "plan.yaml"
        console.say(
            "largest use of limits: "
            + ", ".join(f"{use.what} {100 * use.share:.0f} % ({use.joint})" for use in exported.uses)
        )
        for remark in document["remarks"]:
            console.say(remark)
        console.say(
            f"wrote {len(document['signals'])} signals and {len(document['moves'])} moves to {self.out}, "
            f"{document['seconds_on_the_robot'] / 60:.0f} minutes at {document['rate_hz']:g} Hz"
        )
        console.finish(
            document,
            f"play them, log t, q1… and tau1… of each into a folder, and flexcal measure {quoted(plan)}{robot_option(plan, robot)} "
            "--cell FOLDER --out frequency",
        )
