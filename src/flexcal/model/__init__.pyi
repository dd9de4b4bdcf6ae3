from .energies import energy_regressor
from .equilibrium import Equilibrium, gravity_torque, static_equilibrium
from .inertia import Inertia
from .inverse_kinematics import reach_points
from .joint import ElasticJoint, Joint
from .kinematics import PointKinematics, point_kinematics
from .point import Payload, Point
from .regressor import inertial_names, inertial_parameters, torque_regressor
from .regressor_adjoint import torque_regressor_adjoint
from .resting_tool import ToolAtRest, carried_mass, tool_at_rest
from .robot_model import RobotModel

__all__ = [
    "ElasticJoint",
    "Equilibrium",
    "Inertia",
    "Joint",
    "Payload",
    "Point",
    "PointKinematics",
    "RobotModel",
    "ToolAtRest",
    "carried_mass",
    "energy_regressor",
    "gravity_torque",
    "inertial_names",
    "inertial_parameters",
    "point_kinematics",
    "reach_points",
    "static_equilibrium",
    "tool_at_rest",
    "torque_regressor",
    "torque_regressor_adjoint",
]
