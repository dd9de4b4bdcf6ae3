from .actuator_fit import ActuatorFit, fit_actuators
from .servo_parameters import Servo
from .tracking_errors import TrackingErrors

__all__ = [
    "ActuatorFit",
    "Servo",
    "TrackingErrors",
    "fit_actuators",
]
