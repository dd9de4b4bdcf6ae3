from .experiment import SimulatedExperiment
from .integration_steps import ForwardSteps, forward_steps
from .state_transition import ForwardModel, ForwardModels

__all__ = [
    "ForwardModel",
    "ForwardModels",
    "ForwardSteps",
    "SimulatedExperiment",
    "forward_steps",
]
