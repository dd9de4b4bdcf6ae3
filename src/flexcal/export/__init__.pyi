from .dh import render_dh
from .exported import Exported, Rendered, write_rendered
from .json_document import render_json
from .kinematics import render_kinematics
from .loss import Distances, Loss, LostTerm, measure_loss
from .mjcf import mjcf_spec
from .mjcf_file import render_mjcf, write_mjcf
from .offsets import render_offsets
from .sdf import render_sdf
from .urdf import render_urdf, write_urdf

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
