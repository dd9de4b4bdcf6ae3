from .arm_side import ArmSide
from .arm_yield import ArmYield, error_sources
from .bandwidth import MotionBandwidth, motion_bandwidth
from .base_parameters import BaseParameters
from .batched_equations import Batch, ExperimentSystem, experiment_system
from .bearing_spring import BearingSpring
from .cutoff_choice import CutoffChoice, Piece, choose_cutoff, pieces
from .didim import direct_and_inverse
from .drive_play import with_play
from .drive_spring import DriveSpring, Play
from .drive_terms import (
    CLASSIC,
    Column,
    Coulomb,
    Coupling,
    DriveTerm,
    JointSprings,
    RotorInertia,
    TorqueOffset,
    Viscous,
)
from .ekf import kalman_filter
from .elimination import EssentialParameters, essential_parameters
from .energy_model import energy_least_squares
from .experiment import Experiment, Window
from .feasible import feasible_least_squares
from .friction_choice import Candidate, Trial
from .friction_library import AsymmetricCoulomb, LoadCoulomb, Presliding, Stribeck, SublinearViscous, WarmUp
from .friction_selection import FrictionSelection, select_friction
from .friction_terms import FRICTION_TERMS
from .gain_fit import drive_gains
from .gaussian_process import GaussianProcess, require_scikit_learn
from .idim_iv import instrumental_variables
from .irls import huber_least_squares
from .joint_loads import external_torque
from .joint_log import JointLog, log_blocks
from .learned_errors import ResidualErrors, residual_errors
from .learned_residual import LearnedMotor, LearnedResidual
from .learned_residual_file import (
    LEARNED,
    read_learned_residual,
    require_learned_place,
    write_learned_residual,
)
from .log_faults import LogFaults
from .motion import Motion
from .noisy_columns import column_errors, noisy_logs
from .nominal_spread import with_nominal_spread
from .observation import Observation
from .ols import ordinary_least_squares
from .payload_equations import PayloadEquations
from .payload_fit import PayloadFit, identify_payload
from .periodic_likelihood import maximum_likelihood
from .power_model import power_least_squares
from .prior_fit import identify_with_prior
from .recorded_rows import RecordedRows
from .regression import RegressionData, Subsystem, batches_each, observe
from .residual_learning import BlockErrors, learn_residual
from .robot_prior import RobotPrior
from .sensor_offset import SensorOffset
from .sensor_share import ExternalExcess, ExternalShare, external_share
from .simulated_experiment import SimulatedExperiment
from .spring_attenuation import attenuation
from .tls import total_least_squares
from .torque_prediction import TorquePrediction, predict_torques
from .trajectory_misfit import trajectory_error
from .triangle import Triangle
from .wls import weighted_least_squares

__all__ = [
    "CLASSIC",
    "FRICTION_TERMS",
    "LEARNED",
    "ArmSide",
    "ArmYield",
    "AsymmetricCoulomb",
    "BaseParameters",
    "Batch",
    "BearingSpring",
    "BlockErrors",
    "Candidate",
    "Column",
    "Coulomb",
    "Coupling",
    "CutoffChoice",
    "DriveSpring",
    "DriveTerm",
    "EssentialParameters",
    "Experiment",
    "ExperimentSystem",
    "ExternalExcess",
    "ExternalShare",
    "FrictionSelection",
    "GaussianProcess",
    "JointLog",
    "JointSprings",
    "LearnedMotor",
    "LearnedResidual",
    "LoadCoulomb",
    "LogFaults",
    "Motion",
    "MotionBandwidth",
    "Observation",
    "PayloadEquations",
    "PayloadFit",
    "Piece",
    "Play",
    "Presliding",
    "RecordedRows",
    "RegressionData",
    "ResidualErrors",
    "RobotPrior",
    "RotorInertia",
    "SensorOffset",
    "SimulatedExperiment",
    "Stribeck",
    "SublinearViscous",
    "Subsystem",
    "TorqueOffset",
    "TorquePrediction",
    "Trial",
    "Triangle",
    "Viscous",
    "WarmUp",
    "Window",
    "attenuation",
    "batches_each",
    "choose_cutoff",
    "column_errors",
    "direct_and_inverse",
    "drive_gains",
    "energy_least_squares",
    "error_sources",
    "essential_parameters",
    "experiment_system",
    "external_share",
    "external_torque",
    "feasible_least_squares",
    "huber_least_squares",
    "identify_payload",
    "identify_with_prior",
    "instrumental_variables",
    "kalman_filter",
    "learn_residual",
    "log_blocks",
    "maximum_likelihood",
    "motion_bandwidth",
    "noisy_logs",
    "observe",
    "ordinary_least_squares",
    "pieces",
    "power_least_squares",
    "predict_torques",
    "read_learned_residual",
    "require_learned_place",
    "require_scikit_learn",
    "residual_errors",
    "select_friction",
    "total_least_squares",
    "trajectory_error",
    "weighted_least_squares",
    "with_nominal_spread",
    "with_play",
    "write_learned_residual",
]
