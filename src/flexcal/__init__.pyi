from .calibration.accuracy import repeatability
from .calibration.fit import fit_geometry
from .calibration.measurement import predict_measurements, register, rigid_motion
from .calibration.term_selection import select_terms
from .calibration.verification import prediction_errors
from .data.plans import MultisinePlan, PosePlan, TrajectoryPlan, read_plan
from .data.poses import PoseSet, ToolTargets, read_poses, read_targets
from .data.recordings import Decimation, Recording, read_recording
from .design.poses import random_poses
from .design.scene import MeasuringSetup
from .dynamics.diagnostics import predict_torques
from .dynamics.estimators import (
    DIDIM,
    EKF,
    IRLS,
    IV,
    ML,
    OLS,
    SDP,
    TLS,
    WLS,
    EnergyModel,
    Estimator,
    PowerModel,
    feasible_least_squares,
    weighted_least_squares,
)
from .dynamics.friction import select_friction
from .dynamics.inertials import identify_with_prior, trajectory_error
from .dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from .dynamics.regression import assemble_regression, experiment_system
from .dynamics.residual import read_learned_residual
from .dynamics.signals import JointLog, Window
from .errors import FlexcalError, InputError
from .estimation import Estimate
from .export import write_mjcf, write_urdf
from .files.formats import read_yaml
from .frequency.periodic import (
    FrequencyResponse,
    frequency_response,
    frequency_responses,
    local_polynomial_responses,
)
from .jobs.accuracy import AccuracyMap, Verification, accuracy_map, verify
from .jobs.calibration import Calibration, calibrate
from .jobs.deployment import Compensation, Prediction, compensate, predict
from .jobs.dynamics import DynamicsIdentification, identify_dynamics
from .jobs.experiments import (
    DesignedFrequency,
    DesignedNextPoses,
    DesignedPoses,
    DesignedTrajectories,
    FrequencyRequest,
    PoseRequest,
    TrajectoryRequest,
    design_frequency,
    design_next_poses,
    design_poses,
    design_trajectories,
    exciting_plan,
    frequency_plan,
)
from .jobs.inputs import CalibratedRobot
from .jobs.payload import PayloadIdentification, identify_payload
from .jobs.stiffness import StiffnessIdentification, identify_stiffness
from .model.kinematics import point_kinematics
from .model.parts import is_physically_consistent
from .model.robot import RobotModel
from .model.statics import gravity_torque, static_equilibrium, tool_at_rest
from .model.torques import torque_regressor
from .virtual_cell import CellConfig, VirtualCell, draw_truth

__version__: str

__all__ = [
    "CLASSIC",
    "DIDIM",
    "EKF",
    "IRLS",
    "IV",
    "ML",
    "OLS",
    "SDP",
    "TLS",
    "WLS",
    "AccuracyMap",
    "BaseParameters",
    "CalibratedRobot",
    "Calibration",
    "CellConfig",
    "Compensation",
    "Decimation",
    "DesignedFrequency",
    "DesignedNextPoses",
    "DesignedPoses",
    "DesignedTrajectories",
    "DynamicsIdentification",
    "EnergyModel",
    "Estimate",
    "Estimator",
    "FlexcalError",
    "FrequencyRequest",
    "FrequencyResponse",
    "InputError",
    "JointLog",
    "MeasuringSetup",
    "MultisinePlan",
    "Observation",
    "PayloadIdentification",
    "PosePlan",
    "PoseRequest",
    "PoseSet",
    "PowerModel",
    "Prediction",
    "Recording",
    "RobotModel",
    "StiffnessIdentification",
    "ToolTargets",
    "TrajectoryPlan",
    "TrajectoryRequest",
    "Verification",
    "VirtualCell",
    "Window",
    "accuracy_map",
    "assemble_regression",
    "calibrate",
    "compensate",
    "design_frequency",
    "design_next_poses",
    "design_poses",
    "design_trajectories",
    "draw_truth",
    "exciting_plan",
    "experiment_system",
    "feasible_least_squares",
    "fit_geometry",
    "frequency_plan",
    "frequency_response",
    "frequency_responses",
    "gravity_torque",
    "identify_dynamics",
    "identify_payload",
    "identify_stiffness",
    "identify_with_prior",
    "is_physically_consistent",
    "local_polynomial_responses",
    "point_kinematics",
    "predict",
    "predict_measurements",
    "predict_torques",
    "prediction_errors",
    "random_poses",
    "read_learned_residual",
    "read_plan",
    "read_poses",
    "read_recording",
    "read_targets",
    "read_yaml",
    "register",
    "repeatability",
    "rigid_motion",
    "select_friction",
    "select_terms",
    "static_equilibrium",
    "tool_at_rest",
    "torque_regressor",
    "trajectory_error",
    "verify",
    "weighted_least_squares",
    "write_mjcf",
    "write_urdf",
]
