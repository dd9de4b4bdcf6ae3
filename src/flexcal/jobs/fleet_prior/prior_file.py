"""Reading and writing of the prior of a robot model, one YAML file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from flexcal.calibration.fit import FleetPrior
from flexcal.errors import FlexcalError
from flexcal.files.formats import provenance, read_yaml_file, write_yaml
from flexcal.jobs.fleet_prior.geometry_information import is_geometric_error
from flexcal.jobs.fleet_prior.kinematics import NominalJoint, difference_of, nominal_joints
from flexcal.jobs.fleet_prior.model_prior import ModelPrior
from flexcal.jobs.fleet_prior.pooled_values import PooledValues
from flexcal.model.robot import RobotModel, unit_in

_LEAST = 1e-12
"""Standard deviations below which no numbers are known, in any unit."""
_MOST = 10.0
"""Standard deviation of a geometric parameter, rad or m, beyond any robot's."""


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
        _require_positive(self)
        if max(self.std, self.mean_std, self.spread) > _MOST:
            raise FlexcalError("E-PRIOR-021", f"std, mean_std and spread are in rad or m, below {_MOST:g}.")


@dataclass(frozen=True)
class StoredValue:
    """A quantity's `mean` over robots of the model, in its unit; on a log `scale` the standard deviations are of the logarithm."""

    mean: float
    unit: str
    scale: Literal["log", "linear"]
    std: float
    mean_std: float
    spread: float
    freedom: float

    def __post_init__(self) -> None:
        _require_positive(self)
        if self.scale == "log" and not self.mean > 0:
            raise FlexcalError("E-PRIOR-015", f"the mean of a log scale must be positive, not {self.mean:g}.")


def _require_positive(item: StoredParameter | StoredValue) -> None:
    if not min(item.std, item.mean_std, item.spread, item.freedom) > _LEAST:
        raise FlexcalError(
            "E-PRIOR-006", f"std, mean_std, spread and freedom must be positive, above {_LEAST:g}."
        )


@dataclass(frozen=True)
class StoredValues:
    """Quantities of the `robots`, identified under the `condition`: bearing axes of stiffness, terms of friction."""

    robots: tuple[str, ...]
    condition: str
    values: dict[str, StoredValue]
    provenance: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class StoredPrior:
    """Content of the file; row k of `correlation` has the correlations of the mean of parameter k with those before it. `robots` and
    `terms` are those of the geometry, empty where it is not known.
    """

    model: str
    robots: tuple[str, ...]
    terms: tuple[str, ...]
    joints: dict[str, NominalJoint]
    parameters: dict[str, StoredParameter]
    correlation: tuple[tuple[float, ...], ...]
    stiffness: StoredValues | None = None
    friction: StoredValues | None = None
    measurements: dict[str, str] = field(default_factory=dict)
    provenance: dict[str, str] = field(default_factory=dict)


def write_model_prior(path: Path, prior: ModelPrior, model: RobotModel, digests: Mapping[str, str]) -> None:
    """Write a prior, atomically; `digests` are those of the robots' calibrations."""
    geometry = prior.geometry
    parameters: dict[str, StoredParameter] = {}
    correlation: tuple[tuple[float, ...], ...] = ()
    if geometry is not None:
        known, whole = np.sqrt(np.diag(geometry.uncertainty)), np.sqrt(np.diag(geometry.covariance))
        matrix = geometry.uncertainty / np.outer(known, known)
        correlation = tuple(tuple(float(c) for c in matrix[k, :k]) for k in range(1, len(matrix)))
        parameters = {
            name: StoredParameter(
                float(geometry.mean[k]),
                unit_in(model, name),
                float(whole[k]),
                float(known[k]),
                float(geometry.spread[k]),
                float(geometry.freedom[k]),
            )
            for k, name in enumerate(geometry.names)
        }
    stored = StoredPrior(
        model.name,
        () if geometry is None else geometry.robots,
        () if geometry is None else geometry.terms,
        nominal_joints(model),
        parameters,
        correlation,
        _stored(prior.stiffness),
        _stored(prior.friction),
        {} if geometry is None else {name: " ".join(own) for name, own in geometry.measurements.items()},
        provenance() | {f"calibration.{name}": digest for name, digest in digests.items()},
    )
    write_yaml(path, stored)


def _stored(pooled: PooledValues | None) -> StoredValues | None:
    if pooled is None:
        return None
    values = {
        name: StoredValue(
            float(pooled.mean[k]),
            pooled.units[k],
            pooled.scales[k],
            float(pooled.std[k]),
            float(pooled.mean_std[k]),
            float(pooled.spread[k]),
            float(pooled.freedom[k]),
        )
        for k, name in enumerate(pooled.names)
    }
    return StoredValues(pooled.robots, pooled.condition, values, dict(pooled.files))


def _pooled(stored: StoredValues | None) -> PooledValues | None:
    if stored is None:
        return None
    items = list(stored.values.values())
    mean, known, spread, freedom = (
        np.array([getattr(item, key) for item in items]) for key in ("mean", "mean_std", "spread", "freedom")
    )
    return PooledValues(
        tuple(stored.values),
        tuple(item.unit for item in items),
        tuple(item.scale for item in items),
        mean,
        known,
        spread,
        freedom,
        stored.condition,
        stored.robots,
        dict(stored.provenance),
    )


def read_model_prior(path: Path, model: RobotModel) -> ModelPrior:
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
            f"the robot of {model.path} is not of the model of {path} ({stored.model}): {unlike}; give the prior of robots with the same "
            "URDF geometry.",
        )
    for name in stored.parameters:
        if not is_geometric_error(model, name):
            raise file.error(
                "E-PRIOR-019",
                ("parameters", name),
                f"{name} is no geometric error of {model.name}; make the prior again with 'flexcal fleet'.",
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
    if size and np.linalg.eigvalsh(correlation)[0] <= 0:
        raise file.error(
            "E-PRIOR-009",
            ("correlation",),
            "these are no correlations, because their matrix is not positive definite; make the prior again with 'flexcal fleet'.",
        )
    known = np.array([item.mean_std for item in items])
    geometry = FleetPrior(
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
    return ModelPrior(
        geometry if items else None, _pooled(stored.stiffness), _pooled(stored.friction), str(path)
    )
