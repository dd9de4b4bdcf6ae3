"""`flexcal filter`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.shared_options import Estimates, Json, Numbers, Robot, require_robot
from flexcal.cli.arguments.suggested_commands import estimates_option
from flexcal.cli.terminal.console import Console

_LISTED = 20


@dataclass(frozen=True)
class Filter:
    """Correct a robot program: its targets become those that bring the real robot where the nominal one would go.

    PROGRAM is URScript (Universal Robots). Targets written as numbers are corrected, in motions and in variables that are set once;
    all other text stays as it is, byte for byte. Targets that the controller computes when the program runs stay and are listed.

    Poses count in the frame base of the URDF, and the controller's kinematics as those of the URDF.
    """

    robot: Robot
    program: Annotated[Positional[Path], arg(metavar="PROGRAM", help="the program (.script)")]
    out: Annotated[Path, arg(metavar="FILE", aliases=["-o"])] = Path("corrected.script")
    """File for the new program."""
    estimates: Estimates = None
    tool: Annotated[Numbers, arg(metavar="X...", help_behavior_hint="(default: set_tcp of the program)")] = ()
    """Tool centre point in the flange for poses before which the program sets none: position, m, and rotation vector, rad."""
    start: Annotated[
        Numbers, arg(metavar="Q...", help_behavior_hint="(default: the target before, or qnear)")
    ] = ()
    """Joint positions, rad, that have the configuration of the arm at poses before which the program has no joint positions."""
    flange: Annotated[str, arg(metavar="FRAME")] = "tool0"
    """URDF frame of the flange, in which tools are given."""
    reverse: Annotated[bool, arg(help_behavior_hint="")] = False
    """Return from a corrected program to the original one."""
    dry_run: Annotated[bool, arg(help_behavior_hint="")] = False
    """List the targets, and write nothing."""
    json: Json = False

    def run(self) -> None:
        """Correct the program, and print each target and what stays as it is."""
        from flexcal.jobs.deployment import filter_program_file

        require_robot(self.robot, self.program)
        console = Console(self.json)
        result = filter_program_file(
            self.robot,
            self.program,
            None if self.dry_run else self.out,
            estimates=self.estimates,
            tool=self.tool,
            start=self.start,
            flange=self.flange,
            reverse=self.reverse,
        )
        document = result.document()
        rows = document["targets"]
        console.say(result.headline)
        for item in rows[:_LISTED]:
            numbers = ", ".join(f"{value:.6f}" for value in item["after"])
            console.say(
                f"line {item['line']}: {item['name']}: [{numbers}], moved by {item['shift_mm']:.3f} mm and {item['turn_deg']:.3f}°"
            )
        if len(rows) > _LISTED:
            console.say(f"{len(rows) - _LISTED} more under targets in --json")
        for item in document["left"]:
            console.say(f"left as it is: line {item['line']}: {item['text']}: {item['reason']}")
        for remark in document["remarks"]:
            console.say(remark)
        where = estimates_option(self.estimates)
        if self.dry_run:
            console.finish(
                document, f"flexcal filter {self.robot} {self.program}{where} --out {self.out} writes it"
            )
            return
        console.say(f"wrote {self.out}")
        console.finish(
            document,
            f"run {self.out} slowly first; the way back: flexcal filter {self.robot} {self.out} --reverse --out ORIGINAL.script{where}",
        )
