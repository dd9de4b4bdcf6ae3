"""Recordings to dynamic parameters: base parameters, drive terms, least squares with intervals."""

from flexcal.dynamics.arm_side import ArmSide
from flexcal.dynamics.arm_yield import ArmYield, error_sources
from flexcal.dynamics.attenuation import attenuation
from flexcal.dynamics.base_parameters import BaseParameters
from flexcal.dynamics.column_errors import column_errors, noisy_logs
from flexcal.dynamics.didim import direct_and_inverse
from flexcal.dynamics.drive_gains import drive_gains
from flexcal.dynamics.drive_play import with_play
from flexcal.dynamics.drive_spring import DriveSpring, Play
from flexcal.dynamics.drive_terms import (
    CLASSIC,
    Column,
    Coulomb,
    Coupling,
    DriveTerm,
    RotorInertia,
    TorqueOffset,
    Viscous,
)
from flexcal.dynamics.ekf import kalman_filter
from flexcal.dynamics.energy_model import energy_least_squares
from flexcal.dynamics.essential_parameters import EssentialParameters, essential_parameters
from flexcal.dynamics.experiment_system import Batch, ExperimentSystem, experiment_system
from flexcal.dynamics.feasible import feasible_least_squares
from flexcal.dynamics.friction_choice import Candidate, Trial
from flexcal.dynamics.friction_library import (
    AsymmetricCoulomb,
    LoadCoulomb,
    Presliding,
    Stribeck,
    SublinearViscous,
    WarmUp,
)
from flexcal.dynamics.friction_selection import FrictionSelection, select_friction
from flexcal.dynamics.friction_terms import FRICTION_TERMS
from flexcal.dynamics.gaussian_process import GaussianProcess, require_scikit_learn
from flexcal.dynamics.instrumental_variables import instrumental_variables
from flexcal.dynamics.irls import huber_least_squares
from flexcal.dynamics.joint_log import JointLog, log_blocks
from flexcal.dynamics.learned_residual import LearnedMotor, LearnedResidual
from flexcal.dynamics.learned_residual_file import LEARNED, read_learned_residual, write_learned_residual
from flexcal.dynamics.log_faults import LogFaults
from flexcal.dynamics.maximum_likelihood import maximum_likelihood
from flexcal.dynamics.motion import Motion
from flexcal.dynamics.motion_bandwidth import MotionBandwidth, motion_bandwidth
from flexcal.dynamics.observation import Observation
from flexcal.dynamics.ols import ordinary_least_squares
from flexcal.dynamics.payload_equations import PayloadEquations
from flexcal.dynamics.payload_fit import PayloadFit, identify_payload
from flexcal.dynamics.power_model import power_least_squares
from flexcal.dynamics.prior_fit import identify_with_prior
from flexcal.dynamics.recorded_rows import RecordedRows
from flexcal.dynamics.regression import RegressionData, Subsystem, batches_each, observe
from flexcal.dynamics.residual_errors import ResidualErrors, residual_errors
from flexcal.dynamics.residual_learning import BlockErrors, learn_residual
from flexcal.dynamics.robot_prior import RobotPrior
from flexcal.dynamics.rows import Experiment, Window
from flexcal.dynamics.simulated_experiment import SimulatedExperiment
from flexcal.dynamics.tls import total_least_squares
from flexcal.dynamics.torque_prediction import TorquePrediction, predict_torques
from flexcal.dynamics.trajectory_error import trajectory_error
from flexcal.dynamics.triangle import Triangle
from flexcal.dynamics.wls import weighted_least_squares

__all__ = [
    "CLASSIC",
    "FRICTION_TERMS",
    "LEARNED",
    "ArmSide",
    "ArmYield",
    "AsymmetricCoulomb",
    "BaseParameters",
    "Batch",
    "BlockErrors",
    "Candidate",
    "Column",
    "Coulomb",
    "Coupling",
    "DriveSpring",
    "DriveTerm",
    "EssentialParameters",
    "Experiment",
    "ExperimentSystem",
    "FrictionSelection",
    "GaussianProcess",
    "JointLog",
    "LearnedMotor",
    "LearnedResidual",
    "LoadCoulomb",
    "LogFaults",
    "Motion",
    "MotionBandwidth",
    "Observation",
    "PayloadEquations",
    "PayloadFit",
    "Play",
    "Presliding",
    "RecordedRows",
    "RegressionData",
    "ResidualErrors",
    "RobotPrior",
    "RotorInertia",
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
    "column_errors",
    "direct_and_inverse",
    "drive_gains",
    "energy_least_squares",
    "error_sources",
    "essential_parameters",
    "experiment_system",
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
    "power_least_squares",
    "predict_torques",
    "read_learned_residual",
    "require_scikit_learn",
    "residual_errors",
    "select_friction",
    "total_least_squares",
    "trajectory_error",
    "weighted_least_squares",
    "with_play",
    "write_learned_residual",
]
