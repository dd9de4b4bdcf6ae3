"""Content of robot.yaml, one frozen dataclass per block (docs/file-formats.md)."""

from __future__ import annotations

from dataclasses import dataclass, field

from flexcal.errors import FlexcalError
from flexcal.model.parts import Bearings
from flexcal.model.robot.drive_config import (
    DrivesConfig,
    DynamicsConfig,
    ElasticConfig,
    PayloadConfig,
    PriorConfig,
)
from flexcal.model.robot.measuring_config import (
    ArmSensorConfig,
    CameraConfig,
    FaceConfig,
    ForceSensorConfig,
    InclinometerConfig,
    PointConfig,
    SocketsConfig,
    StationConfig,
    Triple,
    WireConfig,
)
from flexcal.printable import excerpt, name_fault
from flexcal.units import MILLIMETRE, temperature_fault

MOST_TOLERANCE = 10 * MILLIMETRE
"""Largest tolerance of the tool's errors, m, that is not taken for one in mm."""


@dataclass(frozen=True)
class GeometryConfig:
    """Terms that the geometric calibration may use, and the joints with backlash.

    `reference_temperature`, °C, at which the calibrated geometry holds where it depends on temperature; by default the mean of the
    calibration.
    """

    terms: str | tuple[str, ...] = "auto"
    backlash: tuple[str, ...] = ()
    reference_temperature: float | None = None

    def __post_init__(self) -> None:
        fault = "" if self.reference_temperature is None else temperature_fault(self.reference_temperature)
        if fault:
            raise FlexcalError("E-ROBOT-080", f"reference_temperature {fault}")
        levels = ("kinematic", "offsets", "lengths", "backlash")
        of_joints = ("gravity_compliance", "lateral_compliance", "thermal_drift")
        known = (*levels, *of_joints, "transmission", "ratio", "thermal", "thermal_links", "thermal_stations")
        if isinstance(self.terms, str) and self.terms != "auto":
            raise FlexcalError(
                "E-ROBOT-015",
                f"geometry terms must be 'auto' or a list out of {', '.join(known)}, not '{self.terms}'.",
            )
        for term in () if isinstance(self.terms, str) else self.terms:
            owner, _, kind = term.rpartition(".")
            if kind not in (of_joints if owner else known):
                raise FlexcalError(
                    "E-ROBOT-016", f"unknown geometry term '{term}'; known are {', '.join(known)}."
                )


@dataclass(frozen=True)
class BoxConfig:
    """Corners of a box in the robot's base frame, m."""

    lower: Triple
    upper: Triple

    def __post_init__(self) -> None:
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=True):
            if not low < high:
                raise FlexcalError(
                    "E-ROBOT-021",
                    f"the box's limits cross along {axis} ({low:g} to {high:g} m); give `lower` and `upper` corners.",
                )


@dataclass(frozen=True)
class LimitsConfig:
    """Limits of a designed motion beyond those of the URDF.

    Accelerations of the joints, rad/s² or m/s², the speed of the first point, m/s, and a box in which that stays.
    """

    acceleration: tuple[float, ...] | None = None
    speed: float | None = None
    box: BoxConfig | None = None

    def __post_init__(self) -> None:
        if min(self.acceleration or (1.0,)) <= 0 or (self.speed is not None and not self.speed > 0):
            raise FlexcalError("E-ROBOT-022", "limits of acceleration and speed must be positive.")


@dataclass(frozen=True)
class RelationConfig:
    """A `joint` whose actual position is `offset` + Σ ratio · actual position of the joints `of`: rad or m, deflection included.

    A joint that stands among its own `of` has a motor, which turns it by that ratio while the others carry it along.
    """

    joint: str
    of: dict[str, float]
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not self.of or 0 in self.of.values():
            raise FlexcalError(
                "E-ROBOT-063",
                f"the relation of '{self.joint}' needs the joints that it follows, each with a ratio other than 0, as "
                "`of: {joint_2: -1.0}`.",
            )


@dataclass(frozen=True)
class LoopConfig:
    """Two frames `a` and `b` of the URDF that coincide: a pin, which leaves a rotation, or a ball.

    `passive`: the joints that this determines, two for a pin and three for a ball, with the positions near which the loop closes while all
    motors are at zero, or at the limit nearest to it (rad or m).
    """

    a: str
    b: str
    passive: dict[str, float]

    def __post_init__(self) -> None:
        if len(self.passive) not in (2, 3):
            raise FlexcalError(
                "E-ROBOT-064",
                f"a loop determines two passive joints by a pin, or three by a ball, not {len(self.passive)}; list them under `passive:`.",
            )


@dataclass(frozen=True)
class ControllerConfig:
    """Joint-side PD gains (N m/rad, N m s/rad) and the rate (Hz) of the position controller."""

    kp: tuple[float, ...]
    kd: tuple[float, ...]
    rate_hz: float

    def __post_init__(self) -> None:
        if min(self.kp, default=0.0) < 0 or min(self.kd, default=0.0) < 0 or not self.rate_hz > 0:
            raise FlexcalError(
                "E-ROBOT-023",
                "the controller's kp and kd must not be negative, and its rate_hz must be positive.",
            )


@dataclass(frozen=True)
class SignalConfig:
    """Conversion of log columns to SI values at the joint: matrix · (gain ⊙ column · unit) + offset · unit."""

    columns: tuple[str, ...]
    unit: str | None = None
    gain: tuple[float, ...] | None = None
    matrix: str | None = None
    offset: tuple[float, ...] | None = None


@dataclass(frozen=True)
class RobotConfig:
    """Content of robot.yaml. `locked`: movable joints of the URDF that stand still, as those of a gripper, and their positions (rad or m).

    `bearings` says whether the bearings of elastic joints tilt before or after the joint's rotation (Eq. 1: after); without it the data
    decide, where they tell. `relations`, beside those that the URDF gives as <mimic>, and `loops` determine joints without motors;
    `motors`: the others in the order of the columns q1, q2, …. `serial` says which robot it is, in a fleet, and `tolerance` its largest P90
    of errors of the tool, m.
    """

    robot: str
    serial: str | None = None
    tolerance: float | None = None
    points: dict[str, PointConfig] = field(default_factory=dict)
    locked: dict[str, float] = field(default_factory=dict)
    relations: tuple[RelationConfig, ...] = ()
    loops: dict[str, LoopConfig] = field(default_factory=dict)
    motors: tuple[str, ...] = ()
    sensors: dict[str, ArmSensorConfig] = field(default_factory=dict)
    payload: PayloadConfig | None = None
    gravity: Triple = (0.0, 0.0, -9.81)
    prior: PriorConfig = field(default_factory=PriorConfig)
    drives: DrivesConfig = field(default_factory=DrivesConfig)
    elastic: tuple[ElasticConfig, ...] = ()
    bearings: Bearings | None = None
    geometry: GeometryConfig = GeometryConfig()
    dynamics: DynamicsConfig = field(default_factory=DynamicsConfig)
    stations: dict[str, StationConfig] = field(default_factory=dict)
    measurements: dict[str, SocketsConfig | CameraConfig | WireConfig | FaceConfig | InclinometerConfig] = (
        field(default_factory=dict)
    )
    obstacles: tuple[str, ...] = ()
    limits: LimitsConfig = LimitsConfig()
    working_volume: BoxConfig | None = None
    controller: ControllerConfig | None = None
    force_sensor: ForceSensorConfig | None = None
    signals: dict[str, SignalConfig] = field(default_factory=dict)
    estimates: str = "estimates.yaml"

    def __post_init__(self) -> None:
        for key in ("points", "stations", "sensors", "measurements", "loops", "signals"):
            for name in getattr(self, key):
                if fault := name_fault(name):
                    raise FlexcalError(
                        "E-ROBOT-082",
                        f"{key}: the name '{excerpt(name)}' holds the character {fault}, which no name may; rename it.",
                    )
        if self.tolerance is not None and not self.tolerance > 0:
            raise FlexcalError("E-ROBOT-079", f"tolerance must be positive, not {self.tolerance:g} m.")
        if self.tolerance is not None and self.tolerance > MOST_TOLERANCE:
            raise FlexcalError(
                "E-ROBOT-081",
                f"tolerance: {self.tolerance:g} m is more than {MOST_TOLERANCE / MILLIMETRE:g} mm; it is in metres: write "
                f"{MILLIMETRE * self.tolerance:g} for {self.tolerance:g} mm.",
            )
