"""`flexcal measure`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.shared_options import (
    Json,
    MaybePath,
    Seed,
)
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted


@dataclass(frozen=True)
class Measure:
    """Carry out a plan of 'design', in the virtual cell or from recorded files."""

    plan: Annotated[Positional[Path], arg(metavar="PLAN", help="the plan (YAML)")]
    cell: Annotated[str, arg(metavar="virtual|DIR")]
    """virtual, or a folder with plan.yaml and the joint logs or poses.csv recorded for it. Logs of the signals of 'export excitation' may
    have any names, rates and beginnings, and need no plan.yaml beside them."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for the measurements."""
    robot: Annotated[
        MaybePath,
        arg(metavar="ROBOT", help_behavior_hint="(default: beside PLAN, else in the current folder)"),
    ] = None
    """robot.yaml."""
    config: Annotated[
        MaybePath, arg(metavar="FILE", help_behavior_hint="(default: cell.yaml beside robot.yaml)")
    ] = None
    """Settings of the virtual cell."""
    truth: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="(default: drawn from the seed)")] = (
        None
    )
    """File of the true parameters of the virtual cell."""
    seed: Seed = 0
    """Seed of the virtual cell's true parameters and noise; use the same seed for all measurements of one robot."""
    json: Json = False

    def run(self) -> None:
        """Measure, and print the files that were written."""
        from flexcal.jobs.experiments import measure
        from flexcal.jobs.inputs import robot_file

        console = Console(self.json)
        robot = robot_file(self.plan, self.robot)
        with console.progress() as progress:
            measurement = measure(
                robot,
                self.plan,
                self.cell,
                self.out,
                config=self.config,
                seed=self.seed,
                truth=self.truth,
                progress=progress,
            )
        for remark in measurement.remarks:
            console.say(remark)
        if measurement.kind == "trajectory":
            console.say(f"wrote {measurement.recordings} recordings to {self.out}")
            verb = "payload" if measurement.loaded else "inertials"
            following = f"flexcal identify {verb} {quoted(robot)} {quoted(self.out)}"
        elif measurement.recordings:
            console.say(
                f"wrote {measurement.recordings} recordings of {measurement.poses} poses to {self.out}"
            )
            following = f"flexcal identify response {quoted(robot)} {quoted(self.out)} --out responses"
        else:
            console.say(f"wrote {measurement.poses} measured points to {self.out / 'poses.csv'}")
            points = f"{quoted(robot)} {quoted(self.out / 'poses.csv')}"
            following = f"flexcal {'verify' if measurement.for_verification else 'calibrate'} {points}"
            if self.plan.suffix not in (".yaml", ".yml"):
                following = f"flexcal verify {points} to verify a calibration, or flexcal calibrate {points}"
        console.finish(measurement.document(), following)
