"""What was identified last of every robot of a fleet, by geometry, and folders that probably are of one robot."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from flexcal.errors import FlexcalError
from flexcal.files.formats import Block
from flexcal.jobs.fleet.places import ROBOT
from flexcal.jobs.fleet.projects import ResultFolder
from flexcal.jobs.fleet_prior import FEWEST, POOLED, Member, alike, difference

_EQUAL = 1000.0
"""Number of times as far apart as two measurements of one robot from which these are equal but for rounding."""
_MOST = 300
"""Largest number of robots of which all pairs are compared, which takes 10 s."""


@dataclass(frozen=True)
class Twin:
    """A robot that is as like another, the `first`, as two measurements of one robot; others differ `times` as much."""

    robot: str
    first: str
    times: float

    @property
    def sentence(self) -> str:
        """How alike they are."""
        times = f"{self.times:.0f} times as much" if self.times < _EQUAL else "far more"
        return f"{self.first} and {self.robot} differ by no more than the errors of their measurements, and other robots {times}"


def latest_members(
    folders: Sequence[ResultFolder], blocks: Sequence[Block] = POOLED
) -> tuple[dict[Block, list[Member]], list[str]]:
    """Every robot with what was identified last of it, by block, and remarks on those that cannot be read; a file is read where no later
    one has all `blocks` of its robot. Calibrations that their own measurements refute do not count.
    """
    latest: dict[Block, dict[str, Member]] = {block: {} for block in blocks}
    remarks: list[str] = []
    there = [folder for folder in folders if folder.estimates.is_file()]
    for folder in sorted(there, key=_time, reverse=True):
        project = folder.project
        if all(project.robot in robots for robots in latest.values()):
            continue
        try:
            read = Member.read(project.robot, project.folder / ROBOT, folder.estimates)
        except FlexcalError as problem:
            remarks.append(str(problem).rstrip("."))
            continue
        for block, robots in latest.items():
            if block in read and not (block == "calibration" and folder.refuted):
                robots.setdefault(project.robot, read[block])
    return {block: [robots[name] for name in sorted(robots)] for block, robots in latest.items()}, remarks


def _time(folder: ResultFolder) -> tuple[bool, datetime]:
    """When its results are of: its date, else, before all that have one, that of its file."""
    changed = datetime.fromtimestamp(folder.estimates.stat().st_mtime)
    return folder.date is not None, folder.date or changed


def by_geometry(members: Mapping[Block, Sequence[Member]]) -> list[dict[Block, list[Member]]]:
    """Members in groups of one URDF name and one geometry, the group with most members of any block first."""
    groups: list[tuple[Member, dict[Block, list[Member]]]] = []
    for block, own in members.items():
        for member in own:
            group = next((g for first, g in groups if not unlike(first, member)), None)
            if group is None:
                group = dict[Block, list[Member]]({each: [] for each in members})
                groups.append((member, group))
            group[block].append(member)
    return sorted((group for _, group in groups), key=lambda g: -max(len(own) for own in g.values()))


def unlike(one: Member, other: Member) -> str:
    """A clause on how the models of two members differ; empty where they do not."""
    if one.model.name != other.model.name:
        return f"its URDF has the name {other.model.name}, not {one.model.name}"
    return difference(one.model, other.model)


def distinct(members: Sequence[Member]) -> tuple[list[Member], dict[str, str]]:
    """Robots of which different things were identified, the first of equal ones, as the fleet counts them; and the others, by name, with
    the one that each is a copy of.
    """
    first: dict[str, Member] = {}
    copies = {}
    for member in members:
        estimate = member.estimate
        measured = {k: v for k, v in estimate.provenance.items() if k.startswith(("input.", "option."))}
        content = json.dumps([measured, [(item.name, float(item.value)) for item in estimate.parameters]])
        other = first.setdefault(content, member)
        if other is not member:
            copies[member.name] = other.name
    return list(first.values()), copies


def twins_of(calibrated: Sequence[Member]) -> list[Twin]:
    """Robots that probably are another of them, of three or more of one geometry with points that were calibrated with the same terms;
    none in groups of more than 300.
    """
    found: list[Twin] = []
    for own in groups_to_compare(calibrated):
        if len(own) <= _MOST:
            found += [Twin(other, one, times) for one, other, times in alike(own)]
    return found


def groups_to_compare(calibrated: Sequence[Member]) -> list[list[Member]]:
    """Calibrated robots that can be compared, three or more each: of one geometry with points, with the same terms, without copies and
    those that had a prior of others.
    """
    groups: list[list[Member]] = []
    for group in by_geometry({"calibration": distinct(calibrated)[0]}):
        by_terms: dict[tuple[str, ...], list[Member]] = defaultdict(list)
        for member in group["calibration"]:
            if member.model.points and not member.has_prior:
                by_terms[member.terms].append(member)
        groups += [own for own in by_terms.values() if len(own) >= FEWEST]
    return groups
