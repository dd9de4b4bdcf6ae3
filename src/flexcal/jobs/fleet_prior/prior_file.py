"""Reading and writing of the prior of a robot model's geometry, one YAML file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from flexcal.calibration.fit import FleetPrior
from flexcal.errors import FlexcalError
from flexcal.files.formats import provenance, read_yaml_file, write_yaml
from flexcal.jobs.fleet_prior.kinematics import NominalJoint, difference_of, nominal_joints
from flexcal.model.robot import RobotModel, unit_in


@dataclass(frozen=True)
class StoredParameter:
    """A parameter's `mean` over robots of the model, its standard deviation `mean_std`, and the `spread` of robots about it, 1σ, known with
    `freedom` degrees of freedom. `std` is that of a further robot, from both.
    """

    mean: float
    unit: str
    std: float
    mean_std: float
    spread: float
    freedom: float

    def __post_init__(self) -> None:
        if not min(self.std, self.mean_std, self.spread, self.freedom) > 0:
            raise FlexcalError("E-PRIOR-006", "std, mean_std, spread and freedom must be positive.")


@dataclass(frozen=True)
class StoredPrior:
    """Content of the file; row k of `correlation` has the correlations of the mean of parameter k with those before it."""

    model: str
    robots: tuple[str, ...]
    terms: tuple[str, ...]
    joints: dict[str, NominalJoint]
    parameters: dict[str, StoredParameter]
    correlation: tuple[tuple[float, ...], ...]
    measurements: dict[str, str] = field(default_factory=dict)
    provenance: dict[str, str] = field(default_factory=dict)


def write_fleet_prior(path: Path, prior: FleetPrior, model: RobotModel, digests: Mapping[str, str]) -> None:
    """Write a prior, atomically; `digests` are those of the robots' calibrations."""
    known, whole = np.sqrt(np.diag(prior.uncertainty)), np.sqrt(np.diag(prior.covariance))
    correlation = prior.uncertainty / np.outer(known, known)
    stored = StoredPrior(
        model.name,
        prior.robots,
        prior.terms,
        nominal_joints(model),
        {
            name: StoredParameter(
                float(prior.mean[k]),
                unit_in(model, name),
                float(whole[k]),
                float(known[k]),
                float(prior.spread[k]),
                float(prior.freedom[k]),
            )
            for k, name in enumerate(prior.names)
        },
        tuple(tuple(float(c) for c in correlation[k, :k]) for k in range(1, len(prior.names))),
        {name: " ".join(digests) for name, digests in prior.measurements.items()},
        provenance() | {f"calibration.{name}": digest for name, digest in digests.items()},
    )
    write_yaml(path, stored)


def read_fleet_prior(path: Path, model: RobotModel) -> FleetPrior:
    """Prior for a robot of the model.

    Raises `InputError` with file and line where the file does not fit, and where its robots have other kinematics than `model`.
    """
    file = read_yaml_file(path)
    stored = file.structure(StoredPrior)
    unlike = difference_of(stored.joints, nominal_joints(model))
    if unlike:
        raise file.error(
            "E-PRIOR-007",
            ("joints",),
            f"{model.name} is not of this model ({stored.model}): {unlike}; give the prior of robots with the same URDF geometry.",
        )
    items, size = list(stored.parameters.values()), len(stored.parameters)
    if [len(row) for row in stored.correlation] != list(range(1, size)):
        raise file.error(
            "E-PRIOR-008",
            ("correlation",),
            f"the correlations of {size} parameters are rows of 1 to {size - 1} numbers; make the prior again with 'flexcal fleet'.",
        )
    correlation = np.eye(size)
    for k, row in enumerate(stored.correlation, 1):
        correlation[k, :k] = correlation[:k, k] = row
    if np.linalg.eigvalsh(correlation)[0] <= 0:
        raise file.error(
            "E-PRIOR-009",
            ("correlation",),
            "these are no correlations, because their matrix is not positive definite; make the prior again with 'flexcal fleet'.",
        )
    known = np.array([item.mean_std for item in items])
    return FleetPrior(
        tuple(stored.parameters),
        np.array([item.mean for item in items]),
        correlation * np.outer(known, known),
        np.array([item.spread for item in items]),
        np.array([item.freedom for item in items]),
        stored.terms,
        stored.robots,
        {name: tuple(digests.split()) for name, digests in stored.measurements.items()},
        str(path),
    )
