from .fleet_pooling import pool_fleet
from .friction_prior import with_friction
from .geometry_pooling import alike, geometry_deviations, pooled_prior
from .kinematics import difference
from .member import FEWEST, FLEET, POOLED, Member, comparable_terms
from .model_prior import ModelPrior
from .pooled_use import PooledUse
from .pooled_values import PoolConflict, PooledValues, conflict
from .prior_file import read_model_prior, write_model_prior
from .stiffness_prior import conflict_after, stiffness_conflict, with_stiffness
from .value_pooling import pool_friction, pool_springs

__all__ = [
    "FEWEST",
    "FLEET",
    "POOLED",
    "Member",
    "ModelPrior",
    "PoolConflict",
    "PooledUse",
    "PooledValues",
    "alike",
    "comparable_terms",
    "conflict",
    "conflict_after",
    "difference",
    "geometry_deviations",
    "pool_fleet",
    "pool_friction",
    "pool_springs",
    "pooled_prior",
    "read_model_prior",
    "stiffness_conflict",
    "with_friction",
    "with_stiffness",
    "write_model_prior",
]
