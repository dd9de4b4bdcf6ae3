"""The prior of a robot model from a fleet's robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.errors import InputError
from flexcal.files.formats import Block
from flexcal.jobs.fleet.job import Fleet, review_fleet
from flexcal.jobs.fleet.members import by_geometry, distinct, latest_members, twins_of, unlike
from flexcal.jobs.fleet.places import local_fleet
from flexcal.jobs.fleet.projects import find_results
from flexcal.jobs.fleet_prior import FEWEST, Member, ModelPrior, PooledValues, pool_fleet
from flexcal.report.layout import counted, listed

_NAMED = 3
"""Largest number of parameters that a sentence names."""
_WHAT: dict[Block, str] = {"calibration": "geometry", "stiffness": "stiffness", "dynamics": "dynamics"}
_IDENTIFIED = {
    "calibration": "calibrated",
    "stiffness": "whose stiffness was identified",
    "dynamics": "whose dynamics were identified",
}


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


def write_prior(place: str | Path, out: Path, reviewed: Fleet | None = None) -> WrittenPrior:
    """Pool what was identified last of the robots of a fleet, those of the geometry that most have, and write the prior of the next.

    Robots that differ from the others beyond chance in any parameter are left out, as the fleet is `reviewed`; it is by default here.
    Raises `InputError` where no three robots have one geometry, and as `pool_fleet` does.
    """
    reviewed = review_fleet(place) if reviewed is None else reviewed
    with local_fleet(str(place)) as root:
        blocks, remarks = latest_members(find_results(root)[0])
        own: dict[Block, list[Member]] = {}
        for block, members in blocks.items():
            members, copies = distinct(members)
            for name, other in copies.items():
                remark = f"without {name}, whose {block} is the same as that of {other}; measure this robot, or give both one `serial:`"
                remarks.append(remark)
            with_prior = [member.name for member in members if member.has_prior]
            own[block] = [member for member in members if not member.has_prior]
            if with_prior:
                remarks.append(
                    f"without {', '.join(with_prior)}, {_IDENTIFIED[block]} with a prior of other robots, which would count twice"
                )
        groups = by_geometry(own)
        if groups:
            remarks += _left_out(str(place), groups)
            own = groups[0]
        own, apart = _without_outlying(own, reviewed)
        remarks += apart
        prior, more = pool_fleet(own, out, remarks)
        remarks += more
    pooled = {member.name for member in own["calibration"]}
    remarks += [batches.of_prior for batches in reviewed.gathered.batches if batches.are_among(pooled)]
    twins = twins_of(own["calibration"])
    remarks += [
        f"{twin.sentence}: if they are one robot, the prior is too narrow; give both one `serial:` in robot.yaml"
        for twin in twins
    ]
    return WrittenPrior(out, prior, tuple(remarks), len({twin.robot for twin in twins}))


def _without_outlying(
    own: Mapping[Block, Sequence[Member]], reviewed: Fleet
) -> tuple[dict[Block, list[Member]], list[str]]:
    """Members without the robots that differ from the others of their model in what was identified, and remarks on these.

    The tests are corrected for the number of robots and parameters, and name a fifth of the robots at most.
    """
    kept, remarks = {}, []
    for block, members in own.items():
        unlike_in: dict[str, list[str]] = {}
        for spread in reviewed.spreads:
            for item in spread.outliers if spread.kind == block else ():
                unlike_in.setdefault(spread.robots[item.number], []).append(spread.name)
        rest = [member for member in members if member.name not in unlike_in]
        kept[block] = rest if len(rest) >= FEWEST else list(members)
        for name in (member.name for member in members if member not in kept[block]):
            remarks.append(
                f"without {name}, whose {_WHAT[block]} differs from that of the others beyond chance in "
                f"{listed(unlike_in[name], _NAMED)}: the prior is of robots like the others"
            )
    return kept, remarks


def _left_out(place: str, groups: Sequence[Mapping[Block, Sequence[Member]]]) -> list[str]:
    """Remarks on groups of robots that are not of the geometry of the first, the largest."""
    firsts = [next(member for own in group.values() for member in own) for group in groups]
    names = [sorted({member.name for own in group.values() for member in own}) for group in groups]
    if len(groups) > 1 and max(len(own) for own in groups[0].values()) < FEWEST:
        listed = "; ".join(", ".join(group) for group in names)
        raise InputError(
            "E-PRIOR-001",
            f"no {FEWEST} identified robots of {place} have one geometry in their URDFs, which a prior needs: {listed}; give a folder with "
            "more robots of one.",
        )
    return [
        f"without {', '.join(others)}, of another model than the {len(names[0])} robots that were pooled: "
        f"{unlike(firsts[0], first)}; for its prior, run flexcal fleet on a folder with these robots alone"
        for first, others in zip(firsts[1:], names[1:], strict=True)
    ]
