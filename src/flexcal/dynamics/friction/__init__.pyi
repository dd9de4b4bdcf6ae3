from .catalogue import FRICTION_TERMS
from .selection import FrictionSelection, select_friction
from .stepwise import Candidate, SelectionStep
from .terms import AsymmetricCoulomb, LoadCoulomb, Presliding, Stribeck, SublinearViscous, WarmUp

__all__ = [
    "FRICTION_TERMS",
    "AsymmetricCoulomb",
    "Candidate",
    "FrictionSelection",
    "LoadCoulomb",
    "Presliding",
    "SelectionStep",
    "Stribeck",
    "SublinearViscous",
    "WarmUp",
    "select_friction",
]
