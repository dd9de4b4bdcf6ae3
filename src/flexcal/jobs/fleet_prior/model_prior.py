"""What identified robots of a model tell of the next."""

from __future__ import annotations

from dataclasses import dataclass

from flexcal.calibration.fit import FleetPrior
from flexcal.jobs.fleet_prior.pooled_values import PooledValues


@dataclass(frozen=True, eq=False)
class ModelPrior:
    """Prior of a robot model: of its `geometry`, of the `stiffness` of its drives and bearings, and of the `friction` of its joints; each
    None where the robots do not tell it. `source` is the file.
    """

    geometry: FleetPrior | None
    stiffness: PooledValues | None
    friction: PooledValues | None
    source: str = ""
