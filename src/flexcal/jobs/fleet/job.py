"""What a fleet's results say of each robot and of each model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexcal.data.plans import page_beside
from flexcal.errors import InputError
from flexcal.jobs.fleet.accuracy import RobotAccuracy, robot_accuracies
from flexcal.jobs.fleet.courses import Record
from flexcal.jobs.fleet.document import fleet_document
from flexcal.jobs.fleet.drifts import Drift, parameter_drifts
from flexcal.jobs.fleet.gathering import GatheredFleet, gather_fleet
from flexcal.jobs.fleet.geometry_drifts import GeometryDrift, geometry_drifts
from flexcal.jobs.fleet.parameters import ParameterSpread, comparable, parameter_spreads
from flexcal.jobs.fleet.rechecks import LatestRecheck, latest_rechecks
from flexcal.jobs.pages import SummarisedResult
from flexcal.progress import Progress, silent
from flexcal.report.layout import write_page
from flexcal.report.pages import fleet_page

LEVEL = 0.05
"""Probability that any robot of a fleet is named where none drifts, and of a model where none is different."""


@dataclass(frozen=True, eq=False, repr=False)
class Fleet(SummarisedResult):
    """Result of `review_fleet`.

    Attributes
    ----------
    place : str
        Folder or address of the fleet.
    gathered : GatheredFleet
        The table of all results, and what could not be read.
    accuracies : list of RobotAccuracy
        Every robot against its tolerance, with its trend.
    drifts : list of Drift
        Trends of parameters, each alone.
    geometry : list of GeometryDrift
        Trends of the geometry, all parameters of a robot together.
    spreads : list of ParameterSpread
        Parameters over the robots of each model.
    rechecks : mapping of LatestRecheck
        The latest recheck of every robot that has one.
    declared : mapping of float
        Tolerances that robot.yaml files have, m, by robot.
    command : str
        The command line, if any.
    """

    place: str
    gathered: GatheredFleet
    accuracies: Sequence[RobotAccuracy]
    drifts: Sequence[Drift]
    geometry: Sequence[GeometryDrift]
    spreads: Sequence[ParameterSpread]
    rechecks: Mapping[str, LatestRecheck]
    declared: Mapping[str, float | None]
    command: str

    @property
    def subject(self) -> str:
        """The place."""
        return self.place

    @property
    def headline(self) -> str:
        """Number of robots, and how many keep their tolerance."""
        return self.document()["headline"]

    def summary(self) -> str:
        """Headline and remarks."""
        document = self.document()
        return "\n".join([document["headline"], *document["remarks"]])

    def document(self) -> dict[str, Any]:
        """All numbers, as --json has them."""
        return fleet_document(
            self.place,
            self.gathered,
            self.accuracies,
            self.drifts,
            self.geometry,
            self.spreads,
            self.rechecks,
            self.declared,
            LEVEL,
            self.command,
        )

    def write(self, out: Path) -> None:
        """Write the table (.parquet or .csv), and the page (.html) of the same name beside it.

        Parameters
        ----------
        out : Path
            The table.
        """
        self.gathered.table.write(out)
        write_page(page_beside(out), fleet_page(self.document()))


def review_fleet(
    place: str | Path,
    *,
    tolerance: float | None = None,
    command: str = "",
    progress: Progress = silent,
) -> Fleet:
    """Gather the results of a fleet's robots, and judge them together.

    Parameters
    ----------
    place : str or Path
        Folder with the projects of the robots, or an address that fsspec reads.
    tolerance : float, optional
        Largest P90 of errors, m, of robots whose robot.yaml has no `tolerance`.
    command : str
        The command line, for the page.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    Fleet
        `summary()`, `document()` and ``write(path)``.

    Raises
    ------
    InputError
        Where there is no such folder, the address cannot be read, or no robot of it can.

    Examples
    --------
    >>> from flexcal import review_fleet
    >>> fleet = review_fleet("examples", tolerance=2e-4)
    >>> len(fleet.accuracies)
    6
    >>> fleet.gathered.table.frame.filter(name="error.p90", kind="verification").height
    0
    """
    gathered = gather_fleet(place, progress)
    robots: dict[str, tuple[str, float | None]] = {}
    for project in gathered.projects:
        declared = robots.get(project.robot, (project.model, None))[1]
        robots[project.robot] = (project.model, project.tolerance or declared)
    if not robots:
        raise InputError("E-FLEET-005", f"{place} holds no project that can be read{_first(gathered)}")
    progress("judging", 0.0)
    records: list[Record] = gathered.table.frame.to_dicts()
    known = {name: (model, own or tolerance) for name, (model, own) in robots.items()}
    parameters = comparable(records)
    drifts = parameter_drifts(parameters, 2 if gathered.courses else 1)
    again = {twin.robot for twin in gathered.twins}
    fleet = Fleet(
        str(place),
        gathered,
        robot_accuracies(known, records, LEVEL),
        drifts,
        geometry_drifts(gathered.courses, 2 if drifts else 1, LEVEL),
        parameter_spreads([r for r in parameters if r["robot"] not in again], LEVEL),
        latest_rechecks(records),
        {name: own for name, (_, own) in robots.items()},
        command,
    )
    progress("judging", 1.0)
    return fleet


def _first(gathered: GatheredFleet) -> str:
    if not gathered.problems:
        return ": there is no robot.yaml in it; give the folder that has the folders of the robots in it."
    first = gathered.problems[0]
    return f"; the first problem: {first.place}: {first.sentence}"
