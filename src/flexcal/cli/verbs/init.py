"""`flexcal init`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.shared_options import Json, MaybeText
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted


@dataclass(frozen=True)
class Init:
    """Create a robot.yaml for the URDF of a robot, with comments on what to complete.

    The joints of a gripper, and others beside the arm, are locked; the frame of the reflector is chosen by its name. Both
    are printed. The URDF stays where it is.
    """

    urdf: Annotated[Positional[Path], arg(metavar="URDF", help="the robot's URDF, not xacro")]
    folder: Annotated[Path, arg(name="out", metavar="DIR")] = Path(".")
    """Folder for robot.yaml."""
    tip: Annotated[
        MaybeText,
        arg(metavar="LINK", help_behavior_hint="(default: the end of the one long chain)"),
    ] = None
    """The link where the arm ends, for a URDF with several arms."""
    json: Json = False

    @property
    def out(self) -> None:
        """None: the verb never overwrites a file, not even its own, and reads the URDF first."""
        return None

    def run(self) -> None:
        """Write robot.yaml, and print the assumptions."""
        from flexcal.jobs.setup import init_robot

        console = Console(self.json)
        described = init_robot(self.urdf, self.folder, tip=self.tip)
        arm, model = described.arm, described.model
        console.say(
            f"{model.name}: {model.n} joints ({', '.join(model.motor_names)}), reach {model.reach:.2f} m"
        )
        if arm.locked:
            stand = ", ".join(f"{name} at {value:g}" for name, value in arm.locked.items())
            console.say(f"not part of the arm, locked: {stand}")
        others = f"; other frames there: {', '.join(arm.frames[1:])}" if arm.frames[1:] else ""
        console.say(f"the reflector is assumed to be in the frame {arm.frame}{others}")
        for remark in described.remarks:
            console.say(remark)
        console.say(f"wrote {described.file}")
        console.finish(
            described.document(),
            f"write the position of the reflector under `points:` in {described.file}, then flexcal design poses {quoted(described.file)} "
            f"--out {quoted(self.folder / 'poses.yaml')}; or, for existing measurements, flexcal import {quoted(described.file)} FILE",
        )
