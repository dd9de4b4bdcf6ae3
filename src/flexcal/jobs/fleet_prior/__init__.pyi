from .pooling import FEWEST, FLEET, CalibratedMember, alike, pool_fleet, pooled_prior
from .prior_file import read_fleet_prior, write_fleet_prior

__all__ = [
    "FEWEST",
    "FLEET",
    "CalibratedMember",
    "alike",
    "pool_fleet",
    "pooled_prior",
    "read_fleet_prior",
    "write_fleet_prior",
]
