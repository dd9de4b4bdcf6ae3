from .dh_table import Convention, render_dh
from .json_model import render_json
from .mjcf_file import render_mjcf, write_mjcf
from .mujoco_spec import mjcf_spec
from .offset_fit import undetermined_offsets
from .offset_table import render_offsets
from .representation_error import Distances, Loss, UnrepresentedTerm, measure_export_error
from .sdf import render_sdf
from .universal_robots import render_kinematics
from .urdf import render_urdf, write_urdf
from .written_file import ExportedFile, RenderedModel, write_rendered

__all__ = [
    "Convention",
    "Distances",
    "ExportedFile",
    "Loss",
    "RenderedModel",
    "UnrepresentedTerm",
    "measure_export_error",
    "mjcf_spec",
    "render_dh",
    "render_json",
    "render_kinematics",
    "render_mjcf",
    "render_offsets",
    "render_sdf",
    "render_urdf",
    "undetermined_offsets",
    "write_mjcf",
    "write_rendered",
    "write_urdf",
]
