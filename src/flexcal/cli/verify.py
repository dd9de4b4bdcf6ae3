"""`flexcal verify`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flexcal.cli.console import Console
from flexcal.cli.options import Json, PoseFiles, Robot, require_files


@dataclass(frozen=True)
class Verify:
    """Compare the calibrated robot with measured positions, none of which the calibration should have seen."""

    robot: Robot
    poses: PoseFiles
    estimates: Annotated[
        Path | None, arg(metavar="FILE", help_behavior_hint="(default: beside robot.yaml)")
    ] = None
    """estimates.yaml to use, or the folder that 'calibrate --out' wrote."""
    out: Annotated[Path | None, arg(metavar="DIR", help_behavior_hint="(default: none)")] = None
    """Folder to leave results.json in."""
    json: Json = False

    def run(self) -> None:
        """Verify, and print the errors."""
        from flexcal.cli.tables import error_table
        from flexcal.workflow.verify_robot import verify_robot

        require_files(self.poses, "POSES")
        console = Console(self.json)
        found = verify_robot(self.robot, self.poses, estimates=self.estimates, out=self.out)
        document = found.document()
        blocks = document["verification"]
        labels = {"nominal": "before (registered only)", "measured": "calibrated"}
        if document["ambiguous_poses"]:
            labels["measured_unambiguous"] = "calibrated, flank certain"
        rows = {label: blocks[key] for key, label in labels.items() if key in blocks}
        console.show(error_table("distance to the measured points", rows))
        console.say(f"the parameters' uncertainty alone makes {document['predicted_std_mm']:.3f} mm (1σ)")
        where = "" if self.estimates is None else f" --estimates {self.estimates}"
        console.finish(document, f"flexcal export urdf {self.robot}{where} --out calibrated.urdf")
