"""Recordings, measured poses and plans: what they are, how they are read and written, where they come from."""

from flexcal.data.cell import Cell
from flexcal.data.multisine_plan import MultisinePlan
from flexcal.data.plan_files import read_plan, read_plan_of, write_plan
from flexcal.data.pose_plan import PosePlan
from flexcal.data.pose_set import PoseSet, concatenate
from flexcal.data.recording import Recording, RecordingLabel
from flexcal.data.time_base import TimeBase

__all__ = [
    "Cell",
    "MultisinePlan",
    "PosePlan",
    "PoseSet",
    "Recording",
    "RecordingLabel",
    "TimeBase",
    "concatenate",
    "read_plan",
    "read_plan_of",
    "write_plan",
]
