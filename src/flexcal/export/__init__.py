"""RobotModel to files that other programs read."""

from flexcal.export.exported import Exported
from flexcal.export.mjcf import mjcf_spec
from flexcal.export.mjcf_file import write_mjcf
from flexcal.export.urdf import write_urdf

__all__ = ["Exported", "mjcf_spec", "write_mjcf", "write_urdf"]
