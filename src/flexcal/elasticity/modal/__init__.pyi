from .axis_masses import AxisMasses, identify_masses, misfit
from .fit import IdentifiedModes, about_at, identify_modes
from .resonance_intervals import Peak, Resonance, antiresonances, peaks, resonances

__all__ = [
    "AxisMasses",
    "IdentifiedModes",
    "Peak",
    "Resonance",
    "about_at",
    "antiresonances",
    "identify_masses",
    "identify_modes",
    "misfit",
    "peaks",
    "resonances",
]
