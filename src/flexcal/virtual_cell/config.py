"""Settings of the virtual cell (cell.yaml), one frozen dataclass per block."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Literal

import numpy as np

from flexcal.errors import FlexcalError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def _not_negative(config: DataclassInstance) -> None:
    for field in fields(config):
        value = getattr(config, field.name)
        if isinstance(value, int | float) and not value >= 0:
            raise FlexcalError("E-CELL-016", f"{field.name} must not be negative, not {value}.")


_SMALLER = {
    "m": {"mm": 1e-3, "µm": 1e-6},
    "rad": {"mrad": 1e-3, "µrad": 1e-6},
    "rad/K": {"µrad/K": 1e-6},
    "1/K": {"µm/m/K": 1e-6},
}
"""Units that values are given in by mistake, and their size, the largest first."""


def _at_most(config: DataclassInstance, largest: float, unit: str, *names: str) -> None:
    """Raise `FlexcalError` for the first of the named values that no robot or instrument has: it is in another unit."""
    for name in names:
        value = float(np.max(getattr(config, name)))
        if value > largest:
            possible = [item for item in _SMALLER[unit].items() if item[1] * value <= largest]
            smaller, size = (possible or list(_SMALLER[unit].items()))[0]
            raise FlexcalError(
                "E-CELL-035",
                f"{name} is {value:g} {unit}, more than {largest:g} {unit}; it is in {unit}: write {size * value:g} for {value:g} "
                f"{smaller}.",
            )


@dataclass(frozen=True)
class LoopConfig:
    """The joint controller beyond what a plan says of it (gains and rate): least plant steps per control tick.

    `rate_filter_hz` is the corner of the low-pass on the differentiated encoder. The feed-forward is that of the controller's own model.
    """

    substeps: int = 1
    rate_filter_hz: float = 200.0

    def __post_init__(self) -> None:
        if not self.rate_filter_hz > 0:
            raise FlexcalError("E-CELL-017", "the controller's rate_filter_hz must be positive.")
        if self.substeps < 1:
            raise FlexcalError(
                "E-CELL-018", f"the controller needs at least one plant step per tick, not {self.substeps}."
            )


@dataclass(frozen=True)
class SensorConfig:
    """Encoder counts per joint turn (0 = ideal), torque noise (N m, 1σ), tracker noise (m, and m per m of distance; 1σ an axis).

    With `arm_encoders` the excited joints are measured on the arm side too. Sensors on the arm that robot.yaml declares have the noise of
    their quantity (m/s², m/s or m, 1σ of a sample), and are as far off as robot.yaml says.
    """

    encoder_counts: int = 2**18
    arm_encoders: bool = False
    torque_noise: float = 1.0
    tracker_noise_m: float = 15e-6
    tracker_noise_per_m: float = 6e-6
    acceleration_noise: float = 0.02
    velocity_noise: float = 5e-5
    displacement_noise: float = 1e-6

    def __post_init__(self) -> None:
        _not_negative(self)
        _at_most(self, 5e-3, "m", "tracker_noise_m", "displacement_noise")


@dataclass(frozen=True)
class FrictionConfig:
    """Motor friction beyond the robot's viscous and Coulomb values.

    `scale` multiplies the robot's viscous and Coulomb friction (0 = a frictionless cell); Coulomb friction is
    tanh(rate / `coulomb_velocity`); `stribeck` is extra friction at rest, relative to Coulomb, that falls with exp(−(rate /
    `stribeck_velocity`)²). Velocities in rad/s at the joint.
    """

    scale: float = 1.0
    coulomb_velocity: float = 0.01
    stribeck: float = 0.0
    stribeck_velocity: float = 0.05

    def __post_init__(self) -> None:
        _not_negative(self)
        if min(self.coulomb_velocity, self.stribeck_velocity) < 1e-9:
            raise FlexcalError(
                "E-CELL-019",
                "friction's coulomb_velocity and stribeck_velocity must be positive, at least 1e-9 rad/s.",
            )


_WIDEST = 5.0
"""Largest standard deviation of the logarithm of a spring: a factor of 150."""


@dataclass(frozen=True)
class SpreadConfig:
    """Deviations of the true parameters from the nominal robot, 1σ unless stated otherwise.

    `mass`, `rotor_inertia` relative; `com`, `length` m; `angle` rad; `stiffness`, `damping` of their logarithm; `backlash`: half gaps
    are uniform between these two, rad.
    """

    mass: float = 0.07
    com: float = 0.010
    rotor_inertia: float = 0.05
    length: float = 3e-4
    angle: float = 5e-4
    backlash: tuple[float, float] = (2e-5, 5e-5)
    stiffness: float = 0.15
    damping: float = 0.3

    def __post_init__(self) -> None:
        _not_negative(self)
        if not 0 <= self.backlash[0] <= self.backlash[1]:
            raise FlexcalError(
                "E-CELL-020",
                "the spread's backlash is [smallest, largest] half gap with 0 ≤ smallest ≤ largest.",
            )
        if max(self.stiffness, self.damping) > _WIDEST:
            raise FlexcalError(
                "E-CELL-021",
                f"the spread's stiffness and damping are of logarithms, at most {_WIDEST:g} (1σ); give for example 0.15.",
            )
        _at_most(self, 0.02, "m", "length")
        _at_most(self, 0.02, "rad", "angle", "backlash")


@dataclass(frozen=True)
class MismatchConfig:
    """Simulated effects that the identified model lacks, all off by default.

    `cubic_stiffness`: relative stiffening of every drive at 1 mrad of twist; `hysteresis`: Dahl hysteresis of every drive, its torque
    over the drive stiffness (rad), reached over `hysteresis_width` (rad); `elastic_wrist`: stiffness (N m/rad) of drive springs at the
    otherwise rigid joints, whose motors are braked unless they are excited; `repeatability`: m, 1σ an axis, of the point from visit to
    visit.

    With temperature, which rises by up to `temperature_rise` (K) from 20 °C in a `temperature_profile`, linearly over the poses, as an arm
    that warms up, or up and down twice: `temperature_drift`, m that the point drifts in one direction over the whole rise;
    `link_growth`, 1/K, by which all lengths from the base on grow; `zero_drift`, rad/K, 1σ of what joints move with their motors still.
    The temperature is then measured, with `temperature_noise`, K, 1σ.
    """

    cubic_stiffness: float = 0.0
    hysteresis: float = 0.0
    hysteresis_width: float = 1e-4
    elastic_wrist: float = 0.0
    repeatability: float = 0.0
    temperature_drift: float = 0.0
    temperature_rise: float = 10.0
    temperature_profile: Literal["linear", "warming", "cycling"] = "linear"
    temperature_noise: float = 0.0
    link_growth: float = 0.0
    zero_drift: float = 0.0

    def __post_init__(self) -> None:
        _not_negative(self)
        if not self.hysteresis_width > 0:
            raise FlexcalError("E-CELL-022", "the mismatch's hysteresis_width must be positive.")
        _at_most(self, 0.02, "m", "repeatability", "temperature_drift")
        _at_most(self, 0.02, "rad", "hysteresis")
        _at_most(self, 1e-3, "rad/K", "zero_drift")
        _at_most(self, 1e-3, "1/K", "link_growth")


@dataclass(frozen=True)
class CellConfig:
    """Settings of a virtual cell.

    Parameters
    ----------
    controller : LoopConfig
        Steps and filter of the position controller.
    sensors : SensorConfig
        Resolution and noise of encoders, torques, tracker and sensors on the arm.
    friction : FrictionConfig
        Friction of the drives, relative to what robot.yaml declares.
    spread : SpreadConfig
        Standard deviations of the true parameters about the nominal robot.
    mismatch : MismatchConfig
        Effects of the true robot that the identified model lacks; all off by default.
    """

    controller: LoopConfig = LoopConfig()
    sensors: SensorConfig = SensorConfig()
    friction: FrictionConfig = FrictionConfig()
    spread: SpreadConfig = SpreadConfig()
    mismatch: MismatchConfig = MismatchConfig()
