"""URDF and robot.yaml to RobotModel, and its forward maps, each with exact derivatives."""

from flexcal.model.elastic_joint import ElasticJoint
from flexcal.model.energy_regressor import energy_regressor
from flexcal.model.equilibrium import Equilibrium, gravity_torque, static_equilibrium
from flexcal.model.inertia import Inertia
from flexcal.model.inverse_kinematics import reach_points
from flexcal.model.joint import Joint
from flexcal.model.kinematics import PointKinematics, point_kinematics
from flexcal.model.point import Payload, Point
from flexcal.model.regressor import inertial_names, inertial_parameters, torque_regressor
from flexcal.model.regressor_adjoint import torque_regressor_adjoint
from flexcal.model.robot_model import RobotModel
from flexcal.model.tool_at_rest import ToolAtRest, carried_mass, tool_at_rest

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
