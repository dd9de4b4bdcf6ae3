from .model import TorqueModel
from .velocities import velocity_options

__all__ = ["TorqueModel", "velocity_options"]
