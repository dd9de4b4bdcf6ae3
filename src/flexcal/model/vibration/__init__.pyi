from .closed_loop import closed_loop_motion, drive_stretch, multisine_torque, strain_power
from .elastic_arm import ElasticArm
from .flexible_torque import flexible_joint_torque, periodic_torque, spring_load
from .linearisation import Linearisation, linearise
from .motor_impedance import KNOT_OCTAVES, friction_response_change, over_frequency
from .sensor_flatness import sensitivity_response_change
from .sensor_outputs import sensor_frame
from .transfer_matrices import transfer_matrix

__all__ = [
    "KNOT_OCTAVES",
    "ElasticArm",
    "Linearisation",
    "closed_loop_motion",
    "drive_stretch",
    "flexible_joint_torque",
    "friction_response_change",
    "linearise",
    "multisine_torque",
    "over_frequency",
    "periodic_torque",
    "sensitivity_response_change",
    "sensor_frame",
    "spring_load",
    "strain_power",
    "transfer_matrix",
]
