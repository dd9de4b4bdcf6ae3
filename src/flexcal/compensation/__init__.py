"""Calibrated model and tool targets to the motor commands that put the real tool there."""

from flexcal.compensation.compensate import Compensation, compensate
from flexcal.compensation.postures import best_posture
from flexcal.compensation.wanted import wanted_pose

__all__ = ["Compensation", "best_posture", "compensate", "wanted_pose"]
