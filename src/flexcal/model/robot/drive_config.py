"""Blocks of robot.yaml on masses, drives, springs and joint torques."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from flexcal.errors import FlexcalError
from flexcal.model.robot.measuring_config import Triple

_LEAST_PRIOR = 1e-12


@dataclass(frozen=True)
class PayloadConfig:
    """A body held by the robot: kg, m, kg m² about its centre of mass, in the axes of `frame`."""

    frame: str
    mass: float
    com: Triple
    mass_std: float = 0.0
    inertia: tuple[Triple, Triple, Triple] | None = None

    def __post_init__(self) -> None:
        if self.mass < 0 or self.mass_std < 0:
            raise FlexcalError("E-ROBOT-007", "the payload's mass and mass_std must not be negative.")
        if self.mass == 0 and (self.mass_std > 0 or self.inertia is not None):
            raise FlexcalError(
                "E-ROBOT-008",
                "a payload of 0 kg has neither mass_std nor inertia; give the mass they belong to, or leave them out.",
            )


@dataclass(frozen=True)
class PriorConfig:
    """Prior standard deviations (1σ) of nominal values: mass (relative), centre of mass (m), inertia tensor about it (relative, beside
    its change with the mass), rotor inertia (relative), stiffness (relative), and the torque constants behind the motor torques that a
    controller gives (relative; 0 for measured torques).

    `length` (m) and `angle` (rad) are those of the joints' geometric errors, and `parameters` those of single ones by name, relative for a
    stiffness; a geometric parameter without is estimated from the measurements alone. `scale` (relative) is that of all nominal lengths
    together, by which those with a prior may be longer in common.
    """

    mass: float = 0.07
    com: float = 0.010
    inertia: float = 0.15
    rotor_inertia: float = 0.05
    stiffness: float = 0.3
    torque_constant: float = 0.05
    length: float | None = None
    angle: float | None = None
    scale: float = 5e-4
    parameters: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("mass", "com", "inertia", "torque_constant"):
            if getattr(self, name) < 0 or 0 < getattr(self, name) < _LEAST_PRIOR:
                raise FlexcalError(
                    "E-ROBOT-009",
                    "the prior's mass, com, inertia and torque_constant must not be negative (0: known exactly), and no less than "
                    f"{_LEAST_PRIOR:g} otherwise; {name} is {getattr(self, name):g}.",
                )
        single = {"rotor_inertia": self.rotor_inertia, "stiffness": self.stiffness, "scale": self.scale}
        named = single | {"length": self.length, "angle": self.angle} | self.parameters
        for name, value in named.items():
            if value is not None and not value >= _LEAST_PRIOR:
                raise FlexcalError(
                    "E-ROBOT-010",
                    f"the prior's {name} must be positive, at least {_LEAST_PRIOR:g}, not {value:g}.",
                )


@dataclass(frozen=True)
class CouplingConfig:
    """Transmission coupling in which `motor` also turns `joint`, by `ratio`; for the identification of dynamics."""

    motor: str
    joint: str
    ratio: float

    def __post_init__(self) -> None:
        if self.motor == self.joint or self.ratio == 0:
            raise FlexcalError(
                "E-ROBOT-011", "a coupling is between two different joints, with a ratio other than 0."
            )


@dataclass(frozen=True)
class DrivesConfig:
    """Drive values referred to the joint, one entry per joint: kg m², N m s/rad, N m, turns per turn.

    `ratio` is for exported joint offsets, `coupling` for the identification of dynamics.
    """

    rotor_inertia: tuple[float, ...] | None = None
    viscous: tuple[float, ...] | None = None
    coulomb: tuple[float, ...] | None = None
    ratio: tuple[float, ...] | None = None
    coupling: tuple[CouplingConfig, ...] = ()


@dataclass(frozen=True)
class SpringConfig:
    """Stiffness (N m/rad) and damping (N m s/rad) of one spring."""

    stiffness: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        if not self.stiffness > 0:
            raise FlexcalError(
                "E-ROBOT-012", f"a stiffness must be positive, not {self.stiffness:g} N m/rad."
            )
        if self.damping < 0:
            raise FlexcalError(
                "E-ROBOT-013", f"a damping must not be negative, not {self.damping:g} N m s/rad."
            )


@dataclass(frozen=True)
class ElasticConfig:
    """An elastic joint: its drive spring and, optionally, the two bearing springs.

    `frame_rpy` turns the parent link's axes into the bearing's: z is the joint axis, x and y the tilt axes at q = 0. The default takes
    the joint's own axis as z and the first axis normal to it, in cyclic order, as x.
    """

    joint: str
    drive: SpringConfig
    bearing_x: SpringConfig | None = None
    bearing_y: SpringConfig | None = None
    frame_rpy: Triple | None = None

    def __post_init__(self) -> None:
        if (self.bearing_x is None) != (self.bearing_y is None):
            raise FlexcalError(
                "E-ROBOT-014",
                f"the elastic joint '{self.joint}' has one bearing spring; give bearing_x and bearing_y or neither.",
            )


@dataclass(frozen=True)
class JointSpringConfig:
    """A spring parallel to a joint, as of a balancer or a hose package, against which the motor gives stiffness · (q - rest).

    `stiffness` in N m/rad (N/m of a prismatic joint), `rest` in rad or m. What is absent is identified.
    """

    joint: str
    stiffness: float | None = None
    rest: float | None = None


@dataclass(frozen=True)
class CableTorqueConfig:
    """A constant `torque` (N m, or N) that the motor of a joint gives against cables; absent: identified."""

    joint: str
    torque: float | None = None


@dataclass(frozen=True)
class DynamicsConfig:
    """Settings of signal preprocessing and friction for the identification of dynamics; omitted cut-off and decimation follow from the
    data.

    friction: "classic" (viscous, Coulomb, offset), a list of terms, or "auto": the classic ones and what cross-validation adds to them.
    torque: what a logged torque is over a sample, as in plans; `tau` in files.
    joint_springs, cable_torques: what acts on a joint beside motor and friction, one entry a joint.
    """

    friction: str | tuple[str, ...] = "auto"
    cutoff_hz: float | None = None
    decimation: int | None = None
    mask_standstill: bool = True
    torque: Literal["held", "instantaneous", "mean"] = field(default="instantaneous", metadata={"key": "tau"})
    joint_springs: tuple[JointSpringConfig, ...] = ()
    cable_torques: tuple[CableTorqueConfig, ...] = ()

    def __post_init__(self) -> None:
        if isinstance(self.friction, str) and self.friction not in ("auto", "classic"):
            raise FlexcalError(
                "E-ROBOT-017",
                f"friction must be 'auto', 'classic' or a list of terms, not '{self.friction}'.",
            )
        if self.cutoff_hz is not None and not self.cutoff_hz > 0:
            raise FlexcalError("E-ROBOT-018", f"cutoff_hz must be positive, not {self.cutoff_hz:g} Hz.")
        if self.decimation is not None and self.decimation < 1:
            raise FlexcalError("E-ROBOT-019", f"decimation must be 1 or more, not {self.decimation}.")
