"""Pooling of calibrated robots of a model into the prior of the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.calibration.error_model import TRANSMISSION
from flexcal.calibration.fit import FleetPrior, base_errors, plausible_size
from flexcal.errors import FlexcalError, InputError
from flexcal.estimation import Estimate, population
from flexcal.files.formats import block_sha256, read_estimates
from flexcal.jobs.fleet_prior.geometry_information import geometry_information, is_of_cell, is_of_robot
from flexcal.jobs.fleet_prior.kinematics import difference
from flexcal.jobs.fleet_prior.prior_file import write_fleet_prior
from flexcal.model.robot import RobotModel

FEWEST = 3
"""Least number of robots: of the spread of a parameter two have one degree of freedom, with which the variance of a further robot's
parameter (a Student distribution) does not exist; three have two, and what parameters of a kind have in common makes it finite.
"""
FLEET = "fleet"
"""Entry of the provenance of a calibration that had a prior of other robots."""
_TOLD = 0.9
"""Variance of a mean, relative to the plausible one, below which the robots tell something of it."""


@dataclass(frozen=True, eq=False)
class CalibratedMember:
    """A calibrated robot of the fleet: nominal `model`, its `estimate` and the file of that."""

    name: str
    model: RobotModel
    estimate: Estimate
    source: Path | None = None

    @property
    def terms(self) -> tuple[str, ...]:
        """Terms of its calibration, without transmission errors, which are each robot's own."""
        stored = self.estimate.provenance.get("option.terms", "").split()
        return tuple(sorted(term for term in stored if not term.startswith(TRANSMISSION)))


def pool_fleet(robot_files: Sequence[Path], out: Path) -> FleetPrior:
    """Pool the calibrations beside some robot.yaml files, and write the prior to `out`.

    Raises `InputError` for a robot without calibration, and as `pooled_prior` does.
    """
    members = [_member(Path(file)) for file in robot_files]
    prior = pooled_prior(members)
    digests = {m.name: block_sha256(m.source, "calibration") for m in members if m.source is not None}
    write_fleet_prior(out, prior, members[0].model, digests)
    return prior


def pooled_prior(members: Sequence[CalibratedMember]) -> FleetPrior:
    """Prior for a further robot of the model of some calibrated ones (`estimation.population`).

    Raises `InputError` for fewer than three robots, robots of other kinematics or with other terms, and those that were calibrated with
    such a prior themselves, which would count the others twice.
    """
    _require_alike(members)
    model = members[0].model
    base = base_errors(model)
    named = [item.name for member in members for item in member.estimate.parameters]
    names = [name for name in dict.fromkeys(named) if is_of_robot(model, name) and name not in base]
    sizes = np.array([plausible_size(model, name) for name in names])
    cell = [*base, *(name for name in dict.fromkeys(named) if is_of_cell(name))]
    measured = [geometry_information(member.estimate, names, cell, sizes) for member in members]
    pooled = population(measured, sizes, [_kind(name) for name in names])
    prior = FleetPrior(
        tuple(names),
        pooled.mean,
        pooled.uncertainty,
        pooled.spread,
        pooled.freedom,
        members[0].terms,
        tuple(member.name for member in members),
    )
    told = np.diag(pooled.uncertainty) < _TOLD * sizes**2
    return prior.among(name for name, known in zip(names, told, strict=True) if known)


def _member(file: Path) -> CalibratedMember:
    model = RobotModel.from_yaml(file, estimates=False)
    source = model.path.parent / model.config.estimates
    calibration = read_estimates(source).get("calibration") if source.exists() else None
    if calibration is None:
        raise InputError(
            "E-PRIOR-001",
            f"{file}: the robot is not calibrated; run 'flexcal calibrate {file} POSES' first, or leave it out.",
        )
    return CalibratedMember(file.parent.resolve().name or file.name, model, calibration, source)


def _require_alike(members: Sequence[CalibratedMember]) -> None:
    if len(members) < FEWEST:
        raise FlexcalError(
            "E-PRIOR-002",
            f"{len(members)} calibrated robots of one model do not tell how much such robots differ; a prior needs at least {FEWEST}.",
        )
    first = members[0]
    for member in members:
        unlike = difference(first.model, member.model)
        if unlike:
            raise FlexcalError(
                "E-PRIOR-003",
                f"{member.name} is not of the model of {first.name}: {unlike}; pool robots with the same URDF geometry only.",
            )
        if member.terms != first.terms:
            every = dict.fromkeys([*first.terms, *member.terms])
            raise FlexcalError(
                "E-PRIOR-004",
                f"{first.name} was calibrated with the terms {' '.join(first.terms)}, and {member.name} with {' '.join(member.terms)}, so "
                f"their parameters mean different things; calibrate all with --terms {' '.join(every)} {TRANSMISSION}.",
            )
        if f"input.{FLEET}" in member.estimate.provenance:
            raise FlexcalError(
                "E-PRIOR-005",
                f"{member.name} was calibrated with a prior of other robots, which would count twice; calibrate it without --prior, on "
                "enough poses, or leave it out.",
            )


def _kind(name: str) -> str:
    """Parameters whose spreads resemble each other."""
    key = name.rpartition(".")[2]
    for kind in ("length", "origin", "misalignment", "gravity_compliance_", "ratio"):
        if key.startswith(kind):
            return "length" if kind == "origin" else kind
    return key
