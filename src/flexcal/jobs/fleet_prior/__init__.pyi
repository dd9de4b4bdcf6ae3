from .pooling import FLEET, CalibratedMember, pool_fleet, pooled_prior
from .prior_file import read_fleet_prior, write_fleet_prior

__all__ = ["FLEET", "CalibratedMember", "pool_fleet", "pooled_prior", "read_fleet_prior", "write_fleet_prior"]
