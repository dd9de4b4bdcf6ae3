"""`flexcal certificate`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.particulars import ParticularsOptions
from flexcal.cli.arguments.shared_options import Estimates, Json, Robot, Temperature, require_robot
from flexcal.cli.terminal.console import Console


@dataclass(frozen=True)
class Certificate(ParticularsOptions):
    """Write an accuracy certificate on two sheets of A4: pose accuracy at the same targets before and after compensation.

    BEFORE was measured at the nominal commands of TARGETS, AFTER at the commands that 'flexcal compensate' made from them; both keep the
    pose numbers of TARGETS. Rows with the same pose number are repeated visits to one target. Particulars that are not given stay lines to
    fill in by hand. Print the page, or save it as PDF, from a browser.
    """

    robot: Robot
    targets: Annotated[Path, arg(metavar="FILE")]
    """File of targets that was given to 'flexcal compensate'."""
    before: Annotated[Path, arg(metavar="FILE")]
    """Points measured with nominal commands (CSV or Parquet)."""
    after: Annotated[Path, arg(metavar="FILE")]
    """Points measured with compensated commands."""
    estimates: Estimates = None
    temperature: Temperature = None
    out: Annotated[Path, arg(metavar="FILE", aliases=["-o"])] = Path("certificate.html")
    """The page."""
    json: Json = False

    def run(self) -> None:
        """Compare, and print the accuracy before and after."""
        from flexcal.cli.tables.results import error_table, uncalibrated_rows
        from flexcal.jobs.accuracy import certify_robot

        require_robot(self.robot, self.targets, self.before, self.after)
        console = Console(self.json)
        with console.progress() as progress:
            certificate = certify_robot(
                self.robot,
                self.targets,
                self.before,
                self.after,
                self.out,
                estimates=self.estimates,
                temperature=self.temperature,
                particulars=self.particulars,
                command=command_line(),
                progress=progress,
            )
        document = certificate.document()
        labels = {
            "after": "after, in the calibrated frame",
            "after_refitted": "after, best-fit registered, point found too",
        }
        rows = uncalibrated_rows(document) | {label: document[key]["ap"] for key, label in labels.items()}
        console.show(error_table("pose accuracy AP: distance to the target", rows))
        for key in ("before", "after"):
            if (repeated := document[key]["rp"]) is not None:
                console.say(
                    f"repeatability RP {key}: {repeated['mean_mm']:.3f} mm on average, {repeated['max_mm']:.3f} mm at most"
                )
        for remark in document["remarks"]:
            console.say(remark)
        console.say(certificate.trust.sentence)
        console.say(f"wrote {self.out}: {document['targets']} targets")
        console.finish(document, f"open {self.out} and print it, and sign it")
