"""The prior of a robot model from a fleet's robots."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.errors import FlexcalError, InputError
from flexcal.files.formats import Block
from flexcal.jobs.fleet.places import ROBOT, local_fleet
from flexcal.jobs.fleet.projects import find_results
from flexcal.jobs.fleet_prior import FEWEST, POOLED, Member, ModelPrior, PooledValues, alike, pool_fleet
from flexcal.report.layout import counted

_IDENTIFIED = {
    "calibration": "calibrated",
    "stiffness": "whose stiffness was identified",
    "dynamics": "whose dynamics were identified",
}
_EQUAL = 1000.0
"""Number of times as far apart as two measurements of one robot from which these are equal but for rounding."""


@dataclass(frozen=True)
class WrittenPrior:
    """The `prior` in a `file`, with `remarks` on robots that it is not from; `twins` of its robots are probably another of them."""

    file: Path
    prior: ModelPrior
    remarks: tuple[str, ...]
    twins: int = 0

    @property
    def sentence(self) -> str:
        """What the prior is from."""
        parts, geometry = [], self.prior.geometry
        if geometry is not None:
            many = len(geometry.robots)
            robots = (
                f"{many} folders, probably of {many - self.twins} robots" if self.twins else f"{many} robots"
            )
            parts.append(
                f"prior of {counted(len(geometry.names), 'geometric parameter')} from {robots} "
                f"({', '.join(geometry.robots)}), calibrated with the terms {', '.join(geometry.terms)}"
            )
        for what, pooled in (
            ("stiffnesses", self.prior.stiffness),
            ("coefficients of friction", self.prior.friction),
        ):
            if pooled is not None:
                spread = (
                    f"{100 * float(np.median(pooled.spread[_log(pooled)])):.2g} %"
                    if _log(pooled).any()
                    else ""
                )
                differ = f", which differ by {spread} in the median" if spread else ""
                parts.append(
                    f"prior of {len(pooled.names)} {what} from {len(pooled.robots)} robots ({', '.join(pooled.robots)}){differ}"
                )
        return "; ".join(parts)

    def document(self) -> dict[str, Any]:
        """Entry `prior` of --json."""
        geometry = self.prior.geometry
        return {
            "file": self.file,
            "robots": [] if geometry is None else list(geometry.robots),
            "terms": [] if geometry is None else list(geometry.terms),
            "parameters": {}
            if geometry is None
            else {
                name: {"mean": mean, "spread": spread, "freedom": freedom}
                for name, mean, spread, freedom in zip(
                    geometry.names,
                    geometry.mean.tolist(),
                    geometry.spread.tolist(),
                    geometry.freedom.tolist(),
                    strict=True,
                )
            },
            "stiffness": _document(self.prior.stiffness),
            "friction": _document(self.prior.friction),
            "remarks": list(self.remarks),
        }


def _log(pooled: PooledValues) -> np.ndarray:
    return np.array(pooled.scales) == "log"


def _document(pooled: PooledValues | None) -> dict[str, Any] | None:
    if pooled is None:
        return None
    return {
        "robots": list(pooled.robots),
        "condition": pooled.condition,
        "parameters": {
            name: {"mean": mean, "unit": unit, "scale": scale, "spread": spread, "freedom": freedom}
            for name, mean, unit, scale, spread, freedom in zip(
                pooled.names,
                pooled.mean.tolist(),
                pooled.units,
                pooled.scales,
                pooled.spread.tolist(),
                pooled.freedom.tolist(),
                strict=True,
            )
        },
    }


def write_prior(place: str | Path, out: Path) -> WrittenPrior:
    """Pool what was identified last of every robot of a fleet's one model, and write the prior of the next.

    Raises `InputError` where the fleet has robots of several models, and as `pool_fleet` does.
    """
    with local_fleet(str(place)) as root:
        blocks, remarks = _members(root)
        by_model: dict[str, set[str]] = defaultdict(set)
        for members in blocks.values():
            for member in members:
                by_model[member.model.name].add(member.name)
        if len(by_model) > 1:
            listed = ", ".join(f"{name} ({len(own)})" for name, own in by_model.items())
            raise InputError(
                "E-PRIOR-001",
                f"{place} has identified robots of several models: {listed}; a prior is of one, so give a folder with its robots alone.",
            )
        own = {}
        for block, members in blocks.items():
            members, copies = _without_copies(members)
            with_prior = [member.name for member in members if member.has_prior]
            own[block] = [member for member in members if not member.has_prior]
            if with_prior:
                copies.append(
                    f"without {', '.join(with_prior)}, {_IDENTIFIED[block]} with a prior of other robots, which would count twice"
                )
            remarks += [remark for remark in copies if remark not in remarks]
        prior, more = pool_fleet(own, out)
        remarks += more
    calibrated = own["calibration"]
    pairs = alike(calibrated) if len(calibrated) >= FEWEST else []
    for one, other, times in pairs:
        remarks.append(
            f"{one} and {other} differ by no more than the errors of their measurements, and other robots {_times(times)}: if "
            "they are one robot, the prior is too narrow; give both one `serial:` in robot.yaml"
        )
    twins = len({other for _, other, _ in pairs})
    return WrittenPrior(out, prior, tuple(remarks), twins)


def _times(times: float) -> str:
    """How many times as far apart others are, in words; of measurements that are equal no number is meant."""
    return f"{times:.0f} times as much" if times < _EQUAL else "far more"


def _without_copies(members: Sequence[Member]) -> tuple[list[Member], list[str]]:
    """Robots of which different things were identified, the first of equal ones, as the fleet counts them; and remarks on the others."""
    first: dict[str, Member] = {}
    remarks = []
    for member in members:
        estimate = member.estimate
        measured = {k: v for k, v in estimate.provenance.items() if k.startswith(("input.", "option."))}
        content = json.dumps([measured, [(item.name, float(item.value)) for item in estimate.parameters]])
        other = first.setdefault(content, member)
        if other is not member:
            remarks.append(
                f"without {member.name}, whose {member.block} is the same as that of {other.name}; measure this robot, or give both one "
                "`serial:`"
            )
    return list(first.values()), remarks


def _members(root: Path) -> tuple[dict[Block, list[Member]], list[str]]:
    """Every robot with what was identified last of it, by block, and remarks on those that cannot be read."""
    folders, _, _ = find_results(root)
    latest: dict[Block, dict[str, tuple[tuple[bool, datetime], Member]]] = {block: {} for block in POOLED}
    remarks: list[str] = []
    for folder in folders:
        project, source = folder.project, folder.estimates
        if not source.is_file():
            continue
        try:
            blocks = Member.read(project.robot, project.folder / ROBOT, source)
        except FlexcalError as problem:
            remarks.append(str(problem).rstrip("."))
            continue
        changed = datetime.fromtimestamp(source.stat().st_mtime)
        when = folder.date is not None, folder.date or changed
        for block, member in blocks.items():
            robots = latest[block]
            if project.robot not in robots or when > robots[project.robot][0]:
                robots[project.robot] = when, member
    return {block: [robots[name][1] for name in sorted(robots)] for block, robots in latest.items()}, remarks
