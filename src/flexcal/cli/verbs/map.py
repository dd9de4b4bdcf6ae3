"""`flexcal map`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Between,
    Estimates,
    Json,
    MaybeNumber,
    MaybeText,
    On,
    Paths,
    Payload,
    Processes,
    Robot,
    Seed,
    Temperature,
    require_robot,
)
from flexcal.cli.arguments.suggested_commands import estimates_option, temperature_option
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted


@dataclass(frozen=True)
class Map:
    """Predict the accuracy of the tool over the working volume: mean and 95 % bound of its error, from the uncertainty of the calibration.

    The poses are random ones with the target in the volume, in any orientation, or those of a file. With --verification, measured
    poses outside the calibration test the prediction; where they are less accurate than predicted the map is scaled up, but never
    down. The page shows where errors are large, and their sources.
    """

    robot: Robot
    out: Annotated[Path, arg(metavar="FILE", aliases=["-o"])] = Path("map.html")
    """The page (.html), or a table of the poses (.csv, .parquet) with the page beside it."""
    working: Annotated[
        MaybeText,
        arg(metavar="BOX|FILE", help_behavior_hint="(default: as robot.yaml declares, else anywhere)"),
    ] = None
    """Ranges of x, y, z in m like 0.4:0.9,-0.3:0.3,0.2:0.8, or a file of points x, y, z, or of pose, q1, q2 and so on."""
    verification: Annotated[Paths, arg(metavar="FILE...", help_behavior_hint="(default: none)")] = ()
    """Measured poses outside the calibration."""
    count: Annotated[int, arg(metavar="N"), Between(1, 100_000_000)] = 20_000
    """Number of random poses; all poses of a file are used. More than 20000 are computed in blocks; quantiles are then right to 0.1 %."""
    payload: Annotated[
        MaybeNumber, arg(metavar="KG", help_behavior_hint="(default: as robot.yaml declares)"), Payload
    ] = None
    """Payload, kg."""
    temperature: Temperature = None
    estimates: Estimates = None
    seed: Seed = 0
    """Seed of the random poses."""
    jobs: Processes = 1
    on: On = None
    json: Json = False

    def run(self) -> None:
        """Print the predicted accuracy, the worst position and the sources of error."""
        from flexcal.cli.tables.results import error_table, map_table, uncalibrated_rows
        from flexcal.data.plans import page_beside
        from flexcal.jobs.accuracy import map_accuracy

        require_robot(self.robot)
        console = Console(self.json)
        with console.progress() as progress:
            accuracy = map_accuracy(
                self.robot,
                self.out,
                working=self.working,
                count=self.count,
                verification=self.verification,
                payload=self.payload,
                temperature=self.temperature,
                estimates=self.estimates,
                seed=self.seed,
                command=command_line(),
                on=self.on,
                jobs=self.jobs,
                progress=progress,
            )
        document = accuracy.document()
        console.show(map_table(document))
        if document["before"] is not None:
            console.show(error_table("at the verification poses", uncalibrated_rows(document)))
        sources = ", ".join(f"{kind} {100 * share:.0f} %" for kind, share in document["sources"].items())
        console.say(f"reduction of the variance if these were known exactly: {sources}")
        worst = document["worst"][0]
        place = ", ".join(f"{value:.3f}" for value in worst["position_m"])
        console.say(f"worst at {place} m (base frame): 95 % bound {worst['p95_mm']:.3f} mm")
        if (check := document["verification"]) is not None:
            console.say(
                f"errors at {check['poses']} poses are {check['ratio']:.2f} ({check['ratio_low']:.2f} to {check['ratio_high']:.2f}) times "
                f"the predicted size, {100 * check['inside_95_percent']:.0f} % within the bound for 95 %: "
                + _VERDICTS[check["verdict"]].format(check["applied"])
            )
        for remark in document["remarks"]:
            console.say(remark)
        if self.on is not None and accuracy.whole is None:
            console.say(
                f"these poses are one block, which this process computed: {self.on} had nothing to do"
            )
        console.say(accuracy.trust.sentence)
        pages = dict.fromkeys([self.out, page_beside(self.out)])
        console.say(f"wrote {' and '.join(str(path) for path in pages)}: {document['poses']} poses")
        where = estimates_option(self.estimates)
        console.finish(
            document,
            "mend what the verdict names; do not use this calibration before that"
            if accuracy.trust.status == "bad"
            else f"flexcal compensate {quoted(self.robot)} TARGETS.csv{temperature_option(self.temperature)}{where}, for commands with "
            "this accuracy",
        )


_VERDICTS = {
    "right": "the prediction holds",
    "optimistic": "it is too optimistic, and the map, which has no noise of the instrument, is multiplied by {:.2f}",
    "unknown": "the instrument's noise is included, so the prediction cannot be judged; the map is multiplied by {:.2f}",
    "cautious": "it is conservative, and the map is unchanged",
}
