from .experiment import SimulatedExperiment
from .integration_steps import IntegrationSteps, discretise_motion
from .state_transition import StateTransition, StateTransitions

__all__ = [
    "IntegrationSteps",
    "SimulatedExperiment",
    "StateTransition",
    "StateTransitions",
    "discretise_motion",
]
