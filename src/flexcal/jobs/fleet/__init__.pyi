from .gathering import GatheredFleet, gather_fleet
from .job import Fleet, review_fleet
from .prior import WrittenPrior, write_prior
from .table import FleetTable

__all__ = [
    "Fleet",
    "FleetTable",
    "GatheredFleet",
    "WrittenPrior",
    "gather_fleet",
    "review_fleet",
    "write_prior",
]
