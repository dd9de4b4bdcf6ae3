"""RobotModel to files that other programs read."""

from flexcal.export.dh import render_dh
from flexcal.export.exported import Exported, Rendered, write_rendered
from flexcal.export.json_document import render_json
from flexcal.export.kinematics import render_kinematics
from flexcal.export.loss import Distances, Loss, LostTerm, measure_loss
from flexcal.export.mjcf import mjcf_spec
from flexcal.export.mjcf_file import render_mjcf, write_mjcf
from flexcal.export.offsets import render_offsets
from flexcal.export.sdf import render_sdf
from flexcal.export.urdf import render_urdf, write_urdf

__all__ = [
    "Distances",
    "Exported",
    "Loss",
    "LostTerm",
    "Rendered",
    "measure_loss",
    "mjcf_spec",
    "render_dh",
    "render_json",
    "render_kinematics",
    "render_mjcf",
    "render_offsets",
    "render_sdf",
    "render_urdf",
    "write_mjcf",
    "write_rendered",
    "write_urdf",
]
