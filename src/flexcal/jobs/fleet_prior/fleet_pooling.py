"""Pooling of the robots of a fleet into the prior of the next."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from flexcal.errors import FlexcalError
from flexcal.files.formats import Block, block_sha256
from flexcal.jobs.fleet_prior.geometry_pooling import of_equal_terms, pooled_prior
from flexcal.jobs.fleet_prior.member import FEWEST, Member
from flexcal.jobs.fleet_prior.model_prior import ModelPrior
from flexcal.jobs.fleet_prior.pooled_values import PooledValues
from flexcal.jobs.fleet_prior.prior_file import write_model_prior
from flexcal.jobs.fleet_prior.temperatures import temperature_remark
from flexcal.jobs.fleet_prior.value_pooling import pool_friction, pool_springs


def pool_fleet(
    members: Mapping[Block, Sequence[Member]], out: Path, left_out: Sequence[str] = ()
) -> tuple[ModelPrior, list[str]]:
    """Pool robots by the block that was identified of them, and write the prior to `out`; returns it with remarks on what is not in it.

    `left_out` are remarks on robots that are not among the members, for the message where too few are.
    Raises `FlexcalError` as `pooled_prior` does where there are as many calibrations as it needs, and where there is nothing to pool.
    """
    calibrated, remarks = of_equal_terms(members.get("calibration", ()))
    springs = _values(members.get("stiffness", ()), pool_springs, "stiffness", remarks)
    friction = _values(members.get("dynamics", ()), pool_friction, "friction", remarks)
    geometry = None
    if len(calibrated) >= FEWEST or (springs is None and friction is None):
        geometry = pooled_prior(calibrated, [*left_out, *remarks])
        remarks += temperature_remark(calibrated)
    else:
        remarks.append(
            f"without geometry, because {len(calibrated)} robots are calibrated and {FEWEST} are needed"
        )
    prior = ModelPrior(geometry, springs, friction, str(out))
    model = next(own[0].model for own in members.values() if own)
    digests = {m.name: block_sha256(m.source, m.block) for m in calibrated if m.source is not None}
    write_model_prior(out, prior, model, {} if geometry is None else digests)
    return prior, remarks


def _values(
    members: Sequence[Member], pool: Callable[[Sequence[Member]], PooledValues], what: str, remarks: list[str]
) -> PooledValues | None:
    """Pooled values of robots; None, with a remark where any robot has some, where they cannot be pooled."""
    if not members:
        return None
    try:
        pooled = pool(members)
    except FlexcalError as problem:
        remarks.append(f"without {what}: {str(problem).rstrip('.')}")
        return None
    if not pooled.names:
        remarks.append(
            f"without {what}, of which the robots tell nothing that is sharper than a factor of two"
        )
        return None
    return pooled
