from .geometry_information import OF_THE_CELL
from .pooling import FEWEST, FLEET, CalibratedMember, alike, comparable_terms, pool_fleet, pooled_prior
from .prior_file import read_fleet_prior, write_fleet_prior

__all__ = [
    "FEWEST",
    "FLEET",
    "OF_THE_CELL",
    "CalibratedMember",
    "alike",
    "comparable_terms",
    "pool_fleet",
    "pooled_prior",
    "read_fleet_prior",
    "write_fleet_prior",
]
