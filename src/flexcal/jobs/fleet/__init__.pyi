from .gathering import GatheredFleet, gather_fleet
from .job import Fleet, review_fleet
from .table import FleetTable

__all__ = ["Fleet", "FleetTable", "GatheredFleet", "gather_fleet", "review_fleet"]
