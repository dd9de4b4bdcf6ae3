"""RobotModel to files that other programs read."""

from flexcal.export.mjcf import mjcf_spec, write_mjcf
from flexcal.export.urdf import UrdfExport, write_urdf

__all__ = ["UrdfExport", "mjcf_spec", "write_mjcf", "write_urdf"]
