"""flexcal makes industrial robots accurate: the public names, each imported when it is first asked for."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flexcal.calibration import Calibration, calibrate, verify
    from flexcal.cell import VirtualCell
    from flexcal.data import PoseSet, Recording, read_poses
    from flexcal.elasticity import identify_stiffness
    from flexcal.errors import FlexcalError, InputError
    from flexcal.estimation import Estimate
    from flexcal.frequency import FrequencyResponse, frequency_response
    from flexcal.model import RobotModel, point_kinematics, static_equilibrium

    __version__: str

_PLACES = {
    "Calibration": "calibration",
    "Estimate": "estimation",
    "FlexcalError": "errors",
    "FrequencyResponse": "frequency",
    "InputError": "errors",
    "PoseSet": "data",
    "Recording": "data",
    "RobotModel": "model",
    "VirtualCell": "cell",
    "calibrate": "calibration",
    "frequency_response": "frequency",
    "identify_stiffness": "elasticity",
    "point_kinematics": "model",
    "read_poses": "data",
    "static_equilibrium": "model",
    "verify": "calibration",
}

__all__ = [
    "Calibration",
    "Estimate",
    "FlexcalError",
    "FrequencyResponse",
    "InputError",
    "PoseSet",
    "Recording",
    "RobotModel",
    "VirtualCell",
    "calibrate",
    "frequency_response",
    "identify_stiffness",
    "point_kinematics",
    "read_poses",
    "static_equilibrium",
    "verify",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("flexcal")
    if name not in _PLACES:
        raise AttributeError(f"module 'flexcal' has no attribute '{name}'")
    return getattr(import_module(f"flexcal.{_PLACES[name]}"), name)
