from .job import recheck_robot
from .one_visit import recheck
from .planned_visit import PlannedVisit, plan_visit
from .result import Recheck
from .visit_history import VISITS, Visit, read_visits

__all__ = [
    "VISITS",
    "PlannedVisit",
    "Recheck",
    "Visit",
    "plan_visit",
    "read_visits",
    "recheck",
    "recheck_robot",
]
