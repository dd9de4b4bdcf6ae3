from .calibration.fit import fit_geometry
from .calibration.kinds import rigid_motion
from .calibration.verification import prediction_errors
from .data.plans import MultisinePlan, PosePlan, TrajectoryPlan, read_plan
from .data.poses import PoseSet, ToolTargets, read_poses, read_targets
from .data.recordings import CommandLog, Recording, read_command_log, read_recording
from .design.poses import random_poses
from .design.scene import MeasuringSetup
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
)
from .dynamics.residual import read_learned_residual
from .dynamics.torque_model import TorqueModel
from .errors import FlexcalError, InputError
from .estimation import Estimate
from .export import export_urdf
from .files.formats import read_yaml
from .frequency.periodic import FrequencyResponse, PlayedSignal, frequency_responses, played_signals
from .jobs.accuracy import (
    AccuracyMap,
    Certificate,
    Repeatability,
    Verification,
    accuracy_map,
    certify,
    repeatability,
    verify,
)
from .jobs.actuators import ActuatorIdentification, identify_actuators
from .jobs.calibration import Calibration, calibrate
from .jobs.deployment import (
    Compensation,
    FilteredProgram,
    Prediction,
    compensate,
    export_robot,
    filter_program,
    predict,
    read_program,
    read_torque_model,
)
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
from .jobs.fleet import Fleet, FleetTable, review_fleet
from .jobs.gains import GainsIdentification, identify_gains
from .jobs.inertials import InertialsIdentification, identify_inertials
from .jobs.inputs import CalibratedRobot
from .jobs.payload import PayloadIdentification, identify_payload
from .jobs.recheck import Recheck, recheck
from .jobs.response import AxisResponse, frequency_response
from .jobs.stiffness import StiffnessIdentification, identify_stiffness
from .model.robot import RobotModel
from .model.statics import gravity_torque, tool_at_rest
from .programs import Program
from .virtual_cell import CellConfig, VirtualCell, draw_truth

__version__: str

__all__ = [
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
    "ActuatorIdentification",
    "AxisResponse",
    "CalibratedRobot",
    "Calibration",
    "CellConfig",
    "Certificate",
    "CommandLog",
    "Compensation",
    "DesignedFrequency",
    "DesignedNextPoses",
    "DesignedPoses",
    "DesignedTrajectories",
    "DynamicsIdentification",
    "EnergyModel",
    "Estimate",
    "Estimator",
    "FilteredProgram",
    "Fleet",
    "FleetTable",
    "FlexcalError",
    "FrequencyRequest",
    "FrequencyResponse",
    "GainsIdentification",
    "InertialsIdentification",
    "InputError",
    "MeasuringSetup",
    "MultisinePlan",
    "PayloadIdentification",
    "PlayedSignal",
    "PosePlan",
    "PoseRequest",
    "PoseSet",
    "PowerModel",
    "Prediction",
    "Program",
    "Recheck",
    "Recording",
    "Repeatability",
    "RobotModel",
    "StiffnessIdentification",
    "ToolTargets",
    "TorqueModel",
    "TrajectoryPlan",
    "TrajectoryRequest",
    "Verification",
    "VirtualCell",
    "accuracy_map",
    "calibrate",
    "certify",
    "compensate",
    "design_frequency",
    "design_next_poses",
    "design_poses",
    "design_trajectories",
    "draw_truth",
    "exciting_plan",
    "export_robot",
    "export_urdf",
    "filter_program",
    "fit_geometry",
    "frequency_plan",
    "frequency_response",
    "frequency_responses",
    "gravity_torque",
    "identify_actuators",
    "identify_dynamics",
    "identify_gains",
    "identify_inertials",
    "identify_payload",
    "identify_stiffness",
    "played_signals",
    "predict",
    "prediction_errors",
    "random_poses",
    "read_command_log",
    "read_learned_residual",
    "read_plan",
    "read_poses",
    "read_program",
    "read_recording",
    "read_targets",
    "read_torque_model",
    "read_yaml",
    "recheck",
    "repeatability",
    "review_fleet",
    "rigid_motion",
    "tool_at_rest",
    "verify",
]
