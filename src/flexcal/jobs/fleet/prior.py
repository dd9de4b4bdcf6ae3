"""The prior of a robot model from a fleet's robots."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from flexcal.calibration.fit import FleetPrior
from flexcal.errors import FlexcalError, InputError
from flexcal.jobs.fleet.places import ROBOT, local_fleet
from flexcal.jobs.fleet.projects import find_results
from flexcal.jobs.fleet_prior import FEWEST, CalibratedMember, alike, pool_fleet

_EQUAL = 1000.0
"""Number of times as far apart as two measurements of one robot from which these are equal but for rounding."""


@dataclass(frozen=True)
class WrittenPrior:
    """The `prior` in a `file`, with `remarks` on robots that it is not from."""

    file: Path
    prior: FleetPrior
    remarks: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """What the prior is from."""
        return (
            f"prior of {len(self.prior.names)} parameters from {len(self.prior.robots)} robots ({', '.join(self.prior.robots)}), "
            f"calibrated with the terms {', '.join(self.prior.terms)}"
        )

    def document(self) -> dict[str, Any]:
        """Entry `prior` of --json."""
        return {
            "file": self.file,
            "robots": list(self.prior.robots),
            "terms": list(self.prior.terms),
            "parameters": {
                name: {"mean": mean, "spread": spread, "freedom": freedom}
                for name, mean, spread, freedom in zip(
                    self.prior.names,
                    self.prior.mean.tolist(),
                    self.prior.spread.tolist(),
                    self.prior.freedom.tolist(),
                    strict=True,
                )
            },
            "remarks": list(self.remarks),
        }


def write_prior(place: str | Path, out: Path) -> WrittenPrior:
    """Pool the latest calibration of every robot of a fleet's one model, and write the prior of the next.

    Raises `InputError` where the fleet has robots of several models, and as `pooled_prior` does.
    """
    with local_fleet(str(place)) as root:
        members, remarks = _members(root)
        by_model: dict[str, list[CalibratedMember]] = defaultdict(list)
        for member in members:
            by_model[member.model.name].append(member)
        if len(by_model) > 1:
            listed = ", ".join(f"{name} ({len(own)})" for name, own in by_model.items())
            raise InputError(
                "E-PRIOR-001",
                f"{place} has calibrated robots of several models: {listed}; a prior is of one, so give a folder with its robots alone.",
            )
        members, copies = _without_copies(members)
        remarks += copies
        with_prior = [member.name for member in members if member.has_prior]
        own = [member for member in members if not member.has_prior]
        if with_prior:
            remarks.append(
                f"without {', '.join(with_prior)}, calibrated with a prior of other robots, which would count twice"
            )
        prior = pool_fleet(own, out)
    for one, other, times in alike(own) if len(own) >= FEWEST else ():
        remarks.append(
            f"{one} and {other} differ by no more than the errors of their measurements, and other robots {_times(times)}: if "
            "they are one robot, the prior is too narrow; give both one `serial:` in robot.yaml"
        )
    return WrittenPrior(out, prior, tuple(remarks))


def _times(times: float) -> str:
    """How many times as far apart others are, in words; of measurements that are equal no number is meant."""
    return f"{times:.0f} times as much" if times < _EQUAL else "far more"


def _without_copies(
    members: Sequence[CalibratedMember],
) -> tuple[list[CalibratedMember], list[str]]:
    """Robots whose calibrations differ, the first of equal ones, as the fleet counts them; and remarks on the others."""
    first: dict[str, CalibratedMember] = {}
    remarks = []
    for member in members:
        estimate = member.estimate
        measured = {k: v for k, v in estimate.provenance.items() if k.startswith(("input.", "option."))}
        content = json.dumps([measured, [(item.name, float(item.value)) for item in estimate.parameters]])
        other = first.setdefault(content, member)
        if other is not member:
            remarks.append(
                f"without {member.name}, whose calibration is the same as that of {other.name}; measure this robot, or give both one "
                "`serial:`"
            )
    return list(first.values()), remarks


def _members(root: Path) -> tuple[list[CalibratedMember], list[str]]:
    """Every robot with its latest calibration, and remarks on those that cannot be read."""
    folders, _, _ = find_results(root)
    latest: dict[str, tuple[tuple[bool, datetime], CalibratedMember]] = {}
    remarks: list[str] = []
    for folder in folders:
        project, source = folder.project, folder.estimates
        if not source.is_file():
            continue
        try:
            member = CalibratedMember.read(project.robot, project.folder / ROBOT, source)
        except FlexcalError as problem:
            remarks.append(str(problem).rstrip("."))
            continue
        changed = datetime.fromtimestamp(source.stat().st_mtime)
        when = folder.date is not None, folder.date or changed
        if member is not None and (project.robot not in latest or when > latest[project.robot][0]):
            latest[project.robot] = when, member
    return [latest[name][1] for name in sorted(latest)], remarks
