"""Measured points, payload and force sensor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from flexcal.model.parts.inertia import Inertia

_PARAMETERS = ("mass", "com_x", "com_y", "com_z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")


@dataclass(frozen=True, eq=False)
class Point:
    """A target: `xyz` (3,) in a frame that sits at `rotation`, `translation` in the link of joint `joint`."""

    name: str
    frame: str
    joint: int
    rotation: np.ndarray
    translation: np.ndarray
    xyz: np.ndarray


@dataclass(frozen=True, eq=False)
class Payload:
    """A body held in a frame that sits at `rotation`, `translation` in the link of joint `joint`.

    `mass` kg, `com` (3,) in the frame, `inertia` (3, 3) about the centre of mass in frame axes; `nominal_mass` kg is the declared one, with
    standard deviation `mass_std`.
    """

    frame: str
    joint: int
    rotation: np.ndarray
    translation: np.ndarray
    mass: float
    nominal_mass: float
    mass_std: float
    com: np.ndarray
    inertia: np.ndarray

    def carried(self, mass: float) -> Inertia:
        """Inertia, in the link's frame, of `mass` kg at the payload's place; the declared inertia scales with the mass."""
        share = mass / self.mass if self.mass > 0 else 0.0
        return Inertia(mass, self.com_in_link, self.rotation @ (share * self.inertia) @ self.rotation.T)

    @property
    def moments(self) -> np.ndarray:
        """Ixx, Ixy, Ixz, Iyy, Iyz, Izz (6,) of `inertia`."""
        return self.inertia[np.triu_indices(3)]

    @property
    def values(self) -> dict[str, float]:
        """The ten parameters by name: mass, com_x … com_z, and Ixx … Izz about the centre of mass."""
        return dict(zip(_PARAMETERS, map(float, [self.mass, *self.com, *self.moments]), strict=True))

    def with_values(self, values: Mapping[str, float]) -> Payload:
        """Payload with some of `values` changed; if the mass changes, the inertia that is not named scales with it."""
        mass = values.get("mass", self.mass)
        moments = self.moments * (mass / self.mass) if self.mass > 0 else self.moments
        unnamed = dict(zip(_PARAMETERS, [mass, *self.com, *moments], strict=True))
        changed = np.array([values.get(key, value) for key, value in unnamed.items()])
        inertia = np.empty((3, 3))
        inertia[np.triu_indices(3)] = inertia.T[np.triu_indices(3)] = changed[4:]
        return replace(self, mass=float(mass), com=changed[1:4], inertia=inertia)

    @property
    def com_in_link(self) -> np.ndarray:
        """Centre of mass (3,) in the frame of the link that carries the payload, m."""
        return self.translation + self.rotation @ self.com


@dataclass(frozen=True, eq=False)
class ForceSensor:
    """A force and torque sensor whose axes sit at `rotation`, `translation` in the link of joint `joint`.

    `sign` is 1 where it reads what acts on the robot, -1 where it reads what the robot does to its surroundings.
    """

    joint: int
    rotation: np.ndarray
    translation: np.ndarray
    sign: float
