"""`flexcal fleet`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import Json, MaybeNumber, MaybePath, file_argument
from flexcal.cli.terminal.console import Console
from flexcal.errors import FlexcalError, InputError
from flexcal.printable import quoted

_LISTED = 10
"""Largest number of problems that are printed."""
_LEAST = 0.005
"""Smallest tolerance, mm, that is not taken for one in m."""


@dataclass(frozen=True)
class Fleet:
    """Gather the results of many robots in one table, and say which are out of tolerance, which drift, and which differ from the others.

    A robot is a folder with robot.yaml, and with results in it or below; robots are told apart by `serial:` in robot.yaml, or by their
    folders. Results of several visits stay in folders whose names have the day in them, as calibrate --out 2026-03-01.
    """

    fleet: Annotated[
        Positional[str],
        file_argument(
            "DIR", "folder of the robots' folders, or an address for fsspec, as s3://bucket/robots"
        ),
    ]
    out: Annotated[Path, arg(metavar="FILE", aliases=["-o"])] = Path("fleet.parquet")
    """The table (.parquet or .csv), with the page beside it."""
    tolerance: Annotated[
        MaybeNumber, arg(metavar="MM", help_behavior_hint="(default: as each robot.yaml declares)")
    ] = None
    """Largest P90 of errors, mm, for robots whose robot.yaml has no tolerance."""
    prior: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="")] = None
    """Write what the robots tell of their model, geometry, stiffness and friction, to this file (.yaml), for --prior of 'calibrate',
    'identify stiffness' and 'identify dynamics' of the next."""
    json: Json = False

    def run(self) -> FlexcalError | None:
        """Gather, judge, and print every robot that needs attention; returns why no prior could be written, where one was asked for."""
        from flexcal.cli.tables.fleet import fleet_table
        from flexcal.data.plans import page_beside
        from flexcal.data.tables import require_table
        from flexcal.jobs.fleet import review_fleet, write_prior
        from flexcal.model.robot import MOST_TOLERANCE
        from flexcal.units import MILLIMETRE

        require_table(self.out)
        if self.tolerance is not None and not _LEAST <= self.tolerance <= MOST_TOLERANCE / MILLIMETRE:
            raise InputError(
                "E-CLI-049",
                f"--tolerance is {self.tolerance:g} mm; it is in mm, from {_LEAST:g} to {MOST_TOLERANCE / MILLIMETRE:g}, such as 0.25.",
            )
        console = Console(self.json)
        with console.progress() as progress:
            fleet = review_fleet(
                self.fleet,
                tolerance=None if self.tolerance is None else MILLIMETRE * self.tolerance,
                command=command_line(),
                progress=progress,
            )
            fleet.write(self.out)
        document = fleet.document()
        written, refusal = None, None
        if self.prior is not None:
            try:
                written = write_prior(self.fleet, self.prior, fleet)
            except FlexcalError as problem:
                refusal = problem
        console.show(fleet_table(document))
        console.say(document["headline"])
        for remark in document["remarks"]:
            console.say(remark)
        for problem in document["problems"][:_LISTED]:
            console.say(f"{problem['place']}: {problem['sentence']}")
        if len(document["problems"]) > _LISTED:
            console.say(f"{len(document['problems']) - _LISTED} more problems are on the page")
        page = page_beside(self.out)
        console.say(f"wrote {self.out} and {page}: {document['counts']['rows']} rows")
        following = f"open {page}"
        if written is not None:
            document = {**document, "prior": written.document()}
            console.say(written.sentence)
            for remark in written.remarks:
                console.say(remark)
            console.say(f"wrote {self.prior}")
            following = f"flexcal calibrate ROBOT POSES… --prior {quoted(written.file)}, for the next robot of the model"
        console.finish(document, following)
        return refusal
