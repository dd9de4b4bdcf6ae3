from .between_units import RandomEffects, random_effects
from .limit_crossing import Crossing, crossing
from .multiplicity import holm
from .outlying_units import Outlying, outlying
from .trends import FEWEST_VISITS, Course, Trend, moderated_trends

__all__ = [
    "FEWEST_VISITS",
    "Course",
    "Crossing",
    "Outlying",
    "RandomEffects",
    "Trend",
    "crossing",
    "holm",
    "moderated_trends",
    "outlying",
    "random_effects",
]
