"""Unknown parameters of position-controlled actuators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.actuators.start_values import LONGEST_DELAY
from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.export import Actuators, actuator_name, actuator_unit
from flexcal.model.robot import RobotModel

_SPAN = 1e3
"""Factor from its start that a coordinate may reach at most; gains down to the inverse, friction and armature to zero."""
_GAINS = ("stiffness", "damping")
_PER_INERTIA = ("stiffness", "damping", "viscous", "coulomb")
_VAGUE = 3.0
"""Standard deviation of an armature of which nothing is known, over the inertia on its joint."""


@dataclass(frozen=True)
class Servo:
    """What is known of the controllers.

    follows_velocity : whether the damping acts on the difference from the commanded velocity, not on the velocity;
    compensates_gravity : whether they add the torques that hold the links;
    stiffness, damping : known gains (n,), N m/rad and N m s/rad (N/m, N s/m); absent where they are to be found.
    """

    follows_velocity: bool = False
    stiffness: tuple[float, ...] | None = None
    damping: tuple[float, ...] | None = None
    compensates_gravity: bool = False

    @property
    def known(self) -> bool:
        """Whether the gains are."""
        return self.stiffness is not None

    @property
    def keys(self) -> tuple[str, ...]:
        """Unknown quantities of every joint; viscous friction only where it has an effect of its own."""
        gains = () if self.known else ("stiffness", "damping")
        own = ("viscous",) if self.known or self.follows_velocity else ()
        return (*gains, *own, "coulomb", "armature", "delay")

    def applied(self, start: Actuators) -> Actuators:
        """First values with the known gains in place, and what the damping found there exceeds them by as viscous friction."""
        if self.stiffness is None or self.damping is None:
            rest = 0.05 * start.damping if self.follows_velocity else np.zeros_like(start.damping)
            return replace(start, viscous=rest)
        stiffness, damping = np.array(self.stiffness), np.array(self.damping)
        scale = stiffness / start.stiffness
        return replace(
            start,
            stiffness=stiffness,
            damping=damping,
            viscous=np.maximum(scale * start.damping - damping, 0.05 * scale * start.damping),
            coulomb=scale * start.coulomb,
        )


@dataclass(frozen=True, eq=False)
class ServoCoordinates:
    """Coordinates in which actuators are fitted, from first values `start` of a robot whose links have the inertias `links` (n,) on joints.

    With the total inertia I of a joint they are log K/I, log D/I, d/I, f/I, A and T. The armature A then changes the motion only by what
    tells torques, gravity among it, and where nothing does, its column is zero and no other bends with it. With known gains there
    is no common factor, and the coordinates are the parameters themselves. Friction and armature are on no log scale, because where they
    vanish their columns must not.
    """

    model: RobotModel
    servo: Servo
    links: np.ndarray
    start: Actuators

    @property
    def parameters(self) -> Parameters:
        """The coordinates, joint by joint. A rotor inertia that robot.yaml declares is the prior of A, which a vague one
        keeps finite otherwise.
        """
        items = []
        totals = self._totals(self.start.armature)
        for i, joint in enumerate(self.model.joint_names):
            for key in self.servo.keys:
                name, value = actuator_name(joint, key), float(getattr(self.start, key)[i])
                if key in _PER_INERTIA:
                    value /= totals[i]
                if key in _GAINS:
                    items.append(Parameter(name, "", value, value / _SPAN, value * _SPAN, scale="log"))
                elif key == "delay":
                    items.append(Parameter(name, "s", value, 0.0, LONGEST_DELAY))
                elif key == "armature":
                    most = _SPAN * (self.links[i] + value)
                    items.append(Parameter(name, "", value, 0.0, most, prior_std=self._prior(i)))
                else:
                    items.append(Parameter(name, "", value, 0.0, value * _SPAN))
        return Parameters(items)

    def actuators(self, x: np.ndarray | Sequence[float]) -> Actuators:
        """Actuators at the coordinates `x` (p,)."""
        values = self.parameters.natural(x).reshape(-1, len(self.servo.keys)).T
        found = dict(zip(self.servo.keys, values, strict=True))
        totals = self._totals(found["armature"])
        scaled = {key: value * totals if key in _PER_INERTIA else value for key, value in found.items()}
        return replace(self.start, **scaled)

    def natural(self, estimate: Estimate) -> Estimate:
        """An estimate in these coordinates as one of the parameters: gains on a log scale, the others as they are."""
        found = self.actuators(estimate.parameters.coordinates())
        totals, items = self._totals(found.armature), []
        slope = np.eye(len(estimate.parameters))
        for i, joint in enumerate(self.model.joint_names):
            armature = estimate.parameters.index(actuator_name(joint, "armature"))
            for key in self.servo.keys:
                name, value = actuator_name(joint, key), float(getattr(found, key)[i])
                unit, number = actuator_unit(self.model, i, key), estimate.parameters.index(name)
                prior = self._prior(i) if key == "armature" and self.declared[i] else np.inf
                mean = float(self.start.armature[i]) if np.isfinite(prior) else None
                items.append(
                    Parameter(
                        name,
                        unit,
                        value,
                        prior_std=prior,
                        prior_mean=mean,
                        scale="log" if key in _GAINS else "linear",
                    )
                )
                if key in _PER_INERTIA and not self.servo.known:
                    log = key in _GAINS
                    slope[number, number] = 1.0 if log else totals[i]
                    slope[number, armature] = (1.0 if log else value) / totals[i]
        return replace(
            estimate, parameters=Parameters(items), covariance=slope @ estimate.covariance @ slope.T
        )

    @property
    def declared(self) -> np.ndarray:
        """Joints (n,) of which robot.yaml declares the rotor inertia."""
        rotors = self.model.drives.rotor_inertia
        return np.isfinite(rotors) & (np.nan_to_num(rotors) > 0)

    def _prior(self, i: int) -> float:
        if self.declared[i]:
            return float(self.model.prior.rotor_inertia * self.model.drives.rotor_inertia[i])
        return _VAGUE * float(self.links[i] + self.start.armature[i])

    def _totals(self, armature: np.ndarray) -> np.ndarray:
        return np.ones_like(self.links) if self.servo.known else self.links + armature
