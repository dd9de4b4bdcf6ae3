from .axis_masses import AxisMasses, identify_masses, misfit
from .fit import IdentifiedModes, identify_modes, refined_response
from .resonance_intervals import Peak, Resonance, antiresonances, peaks, resonances

__all__ = [
    "AxisMasses",
    "IdentifiedModes",
    "Peak",
    "Resonance",
    "antiresonances",
    "identify_masses",
    "identify_modes",
    "misfit",
    "peaks",
    "refined_response",
    "resonances",
]
