"""The friction terms by the names that robot.yaml gives them, and the shapes in which each is tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.drive_terms import Coulomb, Coupling, DriveTerm, RotorInertia, TorqueOffset, Viscous
from flexcal.dynamics.friction_choice import Candidate
from flexcal.dynamics.friction_library import (
    AsymmetricCoulomb,
    LoadCoulomb,
    Presliding,
    Stribeck,
    SublinearViscous,
    WarmUp,
)
from flexcal.dynamics.motor_axis import motor_axes
from flexcal.dynamics.rows import Experiment, Window
from flexcal.errors import FlexcalError
from flexcal.model import RobotModel

_PLAIN: dict[str, DriveTerm] = {
    "viscous": Viscous(),
    "coulomb": Coulomb(),
    "torque_offset": TorqueOffset(),
    "asymmetric_coulomb": AsymmetricCoulomb(),
}
LIBRARY = ("sublinear_viscous", "load_coulomb", "stribeck", "presliding", "warm_up")
"""What is tried beyond the classic terms; an asymmetric Coulomb friction is not, as it is a torque offset."""
FRICTION_TERMS = (*_PLAIN, *LIBRARY)

_SHARES_OF_TOP_SPEED = (0.003, 0.01, 0.03, 0.1, 0.3)
_SHARES_OF_RANGE = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03)
_SHARES_OF_DURATION = (0.1, 0.2, 0.4, 0.8)


@dataclass(frozen=True, eq=False)
class Scale:
    """What shapes of terms are measured by: top speed and range of the motor axes (n,), duration (s), inertials of the links (10 n,)."""

    top_speed: np.ndarray
    range: np.ndarray
    duration: float
    inertials: np.ndarray

    @classmethod
    def of(
        cls,
        model: RobotModel,
        experiments: Sequence[Experiment],
        windows: Sequence[Window],
        inertials: np.ndarray,
    ) -> Scale:
        """Of what the experiments show inside their windows; an axis that does not move counts as if it moved by 1."""
        axes = motor_axes(model)
        speed, low, high = np.zeros(model.n), np.full(model.n, np.inf), np.full(model.n, -np.inf)
        duration = 0.0
        for experiment, window in zip(experiments, windows, strict=True):
            begun = None
            for block in experiment.blocks():
                inside = (block.time >= window.start) & (block.time < window.end)
                if inside.any():
                    time = block.time[inside]
                    begun = time[0] if begun is None else begun
                    duration = max(duration, float(time[-1] - begun))
                    position = np.stack([axis.of(block.q[inside]) for axis in axes])
                    velocity = np.stack([axis.of(block.dq[inside]) for axis in axes])
                    speed = np.maximum(speed, np.abs(velocity).max(axis=1))
                    low, high = (
                        np.minimum(low, position.min(axis=1)),
                        np.maximum(high, position.max(axis=1)),
                    )
        span = high - low
        return cls(np.where(speed > 0, speed, 1.0), np.where(span > 0, span, 1.0), duration, inertials)


def variants(name: str, scale: Scale) -> tuple[Candidate, ...]:
    """The term `name` of the library in the shapes to try."""
    match name:
        case "sublinear_viscous":
            return (Candidate(name, "", SublinearViscous()),)
        case "load_coulomb":
            return (Candidate(name, "", LoadCoulomb(scale.inertials)),)
        case "stribeck":
            return tuple(
                Candidate(name, f"{share:g} of the top speed", Stribeck(tuple(share * scale.top_speed)))
                for share in _SHARES_OF_TOP_SPEED
            )
        case "presliding":
            return tuple(
                Candidate(name, f"{share:g} of the range", Presliding(tuple(share * scale.range)))
                for share in _SHARES_OF_RANGE
            )
        case _:
            times = [share * scale.duration for share in _SHARES_OF_DURATION]
            return tuple(Candidate(name, f"{time:.3g} s", WarmUp(time)) for time in times)


def plain_terms(friction: tuple[str, ...]) -> tuple[DriveTerm, ...]:
    """Rotor inertia, the terms among `friction` outside the library, and the coupling; raises `FlexcalError` for an unknown name."""
    for name in friction:
        if name not in FRICTION_TERMS:
            raise FlexcalError(f"there is no friction term '{name}'; there are {', '.join(FRICTION_TERMS)}.")
    return (RotorInertia(), *(_PLAIN[name] for name in _PLAIN if name in friction), Coupling())
