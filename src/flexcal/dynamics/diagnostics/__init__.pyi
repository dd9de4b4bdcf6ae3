from .elimination import EssentialParameters, essential_parameters
from .force_sensor_check import ExternalExcess, ExternalShare, external_share
from .gravity_ratio import GravityRatio, weight_shares
from .torque_prediction import TorquePrediction, predict_torques

__all__ = [
    "EssentialParameters",
    "ExternalExcess",
    "ExternalShare",
    "GravityRatio",
    "TorquePrediction",
    "essential_parameters",
    "external_share",
    "predict_torques",
    "weight_shares",
]
