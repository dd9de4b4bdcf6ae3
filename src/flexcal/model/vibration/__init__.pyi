from .closed_loop import closed_loop_motion, drive_pull, multisine_torque, strain_power
from .elastic_arm import ElasticArm
from .flexible_torque import periodic_torque, spring_load, yielding_torque
from .linearisation import Linearisation, linearise
from .motor_impedance import KNOT_OCTAVES, friction_shifts, over_frequency
from .sensor_flatness import flatness_shifts
from .sensor_outputs import sensor_frame
from .transfer_matrices import transfer_matrix

__all__ = [
    "KNOT_OCTAVES",
    "ElasticArm",
    "Linearisation",
    "closed_loop_motion",
    "drive_pull",
    "flatness_shifts",
    "friction_shifts",
    "linearise",
    "multisine_torque",
    "over_frequency",
    "periodic_torque",
    "sensor_frame",
    "spring_load",
    "strain_power",
    "transfer_matrix",
    "yielding_torque",
]
