from .between_units import RandomEffects, random_effects
from .grouping import TwoGroups, two_groups
from .joint_trends import JointLine, JointTest, joint_tests
from .limit_crossing import Crossing, crossing
from .multiplicity import holm
from .outlying_units import Outlying, outlying
from .trends import FEWEST_VISITS, Course, Trend, moderated_trends

__all__ = [
    "FEWEST_VISITS",
    "Course",
    "Crossing",
    "JointLine",
    "JointTest",
    "Outlying",
    "RandomEffects",
    "Trend",
    "TwoGroups",
    "crossing",
    "holm",
    "joint_tests",
    "moderated_trends",
    "outlying",
    "random_effects",
    "two_groups",
]
