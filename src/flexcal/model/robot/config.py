"""Content of robot.yaml, one frozen dataclass per block (docs/file-formats.md)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from flexcal.errors import FlexcalError
from flexcal.model.parts import Bearings
from flexcal.units import temperature_fault

Triple = tuple[float, float, float]
_LEAST_PRIOR = 1e-12


@dataclass(frozen=True)
class AcceptanceConfig:
    """Acceptance cone of a reflector fixed to the tool: `half_angle` (rad, default ±30°) about its `axis` in the frame of the point."""

    axis: Triple
    half_angle: float = 0.5236

    def __post_init__(self) -> None:
        if not any(self.axis) or not 0 < self.half_angle <= 3.1416:
            raise FlexcalError(
                "E-ROBOT-004",
                "an acceptance needs an axis of three numbers, not all zero, and a half_angle between 0 and 3.1416 rad.",
            )


@dataclass(frozen=True)
class PointConfig:
    """Reflector or tip at the nominal position `xyz` (m) in the URDF frame `frame`.

    `acceptance` is declared if a reflector does not turn towards the instrument. `std` (m) is how well `identify tool` knows a tip, which
    enters the intervals of `identify frame`.
    """

    frame: str
    xyz: Triple
    acceptance: AcceptanceConfig | None = None
    std: Triple | None = None


@dataclass(frozen=True)
class ArmSensorConfig:
    """Accelerometer or vibrometer of frequency experiments, at the point `xyz` (m) in the URDF frame `frame`.

    `direction` in which it measures: of an accelerometer in the axes of `frame`, with which it moves; of a vibrometer, which stands still,
    in the robot's base frame. `quantity` is what the log holds, in m/s², m/s or m: without it the acceleration of an accelerometer and the
    velocity of a vibrometer. 1σ: `sensitivity_std` relative, `position_std` m, `direction_std` rad, and `flatness_std`, by which the
    sensitivity departs from a constant over frequency, relative.
    """

    frame: str
    xyz: Triple
    direction: Triple
    kind: Literal["accelerometer", "vibrometer"] = "accelerometer"
    quantity: Literal["acceleration", "velocity", "displacement"] | None = None
    sensitivity_std: float = 0.02
    position_std: float = 0.003
    direction_std: float = 0.02
    flatness_std: float = 0.01

    def __post_init__(self) -> None:
        if not any(self.direction):
            raise FlexcalError("E-ROBOT-005", "a sensor's direction has three numbers, not all zero.")
        if not self.sensitivity_std > 0 or min(self.position_std, self.direction_std, self.flatness_std) < 0:
            raise FlexcalError(
                "E-ROBOT-006",
                "a sensor's sensitivity_std must be positive, its position_std, direction_std and flatness_std not negative.",
            )


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
    """Prior standard deviations (1σ) of nominal values: mass (relative), centre of mass (m), rotor inertia (relative), stiffness
    (relative), and the torque constants behind the motor torques that a controller gives (relative; 0 for measured torques).

    `length` (m) and `angle` (rad) are those of the joints' geometric errors, and `parameters` those of single ones by name, relative for a
    stiffness; a geometric parameter without is estimated from the measurements alone.
    """

    mass: float = 0.07
    com: float = 0.010
    rotor_inertia: float = 0.05
    stiffness: float = 0.3
    torque_constant: float = 0.02
    length: float | None = None
    angle: float | None = None
    parameters: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("mass", "com", "torque_constant"):
            if getattr(self, name) < 0 or 0 < getattr(self, name) < _LEAST_PRIOR:
                raise FlexcalError(
                    "E-ROBOT-009",
                    "the prior's mass, com and torque_constant must not be negative (0: known exactly), and no less than "
                    f"{_LEAST_PRIOR:g} otherwise; {name} is {getattr(self, name):g}.",
                )
        single = {"rotor_inertia": self.rotor_inertia, "stiffness": self.stiffness}
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


@dataclass(frozen=True)
class ForceSensorConfig:
    """A force and torque sensor whose axes lie at `xyz` (m), turned by `rpy` (rad), in the URDF frame `frame`.

    wrench: whether the columns fx, fy, fz, mx, my, mz are what everything beyond the sensor does to the robot ("on_robot"), or the robot
    to that ("on_environment"). offset: what they are without load; "zero" for a sensor that is tared there.
    """

    frame: str
    wrench: Literal["on_robot", "on_environment"]
    xyz: Triple = (0.0, 0.0, 0.0)
    rpy: Triple = (0.0, 0.0, 0.0)
    offset: Literal["estimated", "zero"] = "estimated"


@dataclass(frozen=True)
class StationConfig:
    """Place of the measuring instrument in the robot's base frame (m), for planning only; the calibration estimates it.

    `frame`: URDF frame that carries the instrument, as the hand of another arm; where it is on that is estimated too.
    """

    xyz: Triple | None = None
    line_of_sight: bool = False
    frame: str | None = None

    def __post_init__(self) -> None:
        if self.line_of_sight and self.xyz is None:
            raise FlexcalError("E-ROBOT-020", "line_of_sight needs the station's xyz (m in the base frame).")
        if self.frame is not None and self.xyz is not None:
            raise FlexcalError(
                "E-ROBOT-061",
                "a station has a frame of the robot that carries it, or xyz in the base frame; keep one.",
            )


@dataclass(frozen=True)
class SocketsConfig:
    """Sockets of a fixture, which hold a ball on the tool: their positions by name in the fixture's own axes, m.

    The fixture stands anywhere, and is moved from place to place. std: standard deviation of the distances between its sockets, m.
    at: where it is to stand, m in the base frame with its axes, for design.
    """

    kind: Literal["sockets"]
    sockets: dict[str, Triple]
    std: float = 1e-4
    at: tuple[Triple, ...] = ()

    def __post_init__(self) -> None:
        if not self.sockets:
            raise FlexcalError(
                "E-ROBOT-050", "sockets need at least one position, as `sockets: {a: [0, 0, 0]}`."
            )
        if not self.std > 0:
            raise FlexcalError("E-ROBOT-051", f"std must be positive, not {self.std:g} m.")

    @property
    def extent(self) -> float:
        """Largest distance between two sockets, m; zero for one."""
        return max(math.dist(a, b) for a in self.sockets.values() for b in self.sockets.values())


@dataclass(frozen=True)
class BoardConfig:
    """Printed board: a chessboard or ChArUco board of `columns` × `rows` squares with edges of `square` m, or `tags` at that pitch.

    marker: edge of the markers, m; dictionary: OpenCV's name of their set. std: relative standard deviation of the board's size.
    """

    kind: Literal["charuco", "chessboard", "tags"]
    columns: int
    rows: int
    square: float
    marker: float = 0.0
    dictionary: str = "DICT_4X4_50"
    std: float = 1e-3

    def __post_init__(self) -> None:
        least = 1 if self.kind == "tags" else 3
        if self.columns < least or self.rows < least or not self.square > 0:
            raise FlexcalError(
                "E-ROBOT-052",
                f"a board needs at least {least} columns and rows, and a positive size of its squares.",
            )
        if self.kind != "chessboard" and not 0 < self.marker < self.square:
            raise FlexcalError(
                "E-ROBOT-053",
                f"the markers of a board are smaller than its squares of {self.square:g} m; correct `marker:` ({self.marker:g} m).",
            )
        if not self.std > 0:
            raise FlexcalError("E-ROBOT-054", f"std of a board must be positive, not {self.std:g}.")


@dataclass(frozen=True)
class CameraConfig:
    """Camera that sees a board: on the hand, the board anywhere in the cell, or in the cell, the board on the hand.

    size: width and height of its images, pixels. For design, of what stands in the cell: xyz, roughly where the middle of the board or
    the camera is, m in the base frame; normal, where its printed side faces, or where the camera looks; and axis, the same of what is on
    the hand, in the frame of its point. focal: focal length, pixels; None: as long as the images are wide. std: standard deviation of a
    found corner, pixels. distance: least and largest distance, m, of a sharp image; None: where the board fills it.
    """

    kind: Literal["camera"]
    board: BoardConfig
    size: tuple[int, int]
    mounted: Literal["hand", "cell"] = "hand"
    xyz: Triple | None = None
    normal: Triple = (0.0, 0.0, 1.0)
    axis: Triple = (0.0, 0.0, 1.0)
    focal: float | None = None
    std: float = 0.2
    distance: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if min(self.size) < 1:
            raise FlexcalError(
                "E-ROBOT-055", "size of a camera is the width and height of its images in pixels."
            )
        if not any(self.normal) or not any(self.axis):
            raise FlexcalError(
                "E-ROBOT-058", "normal and axis of a camera are directions; not all numbers may be zero."
            )
        if not self.std > 0 or (self.focal is not None and not self.focal > 0):
            raise FlexcalError("E-ROBOT-059", "std and focal of a camera are positive numbers of pixels.")
        if self.distance is not None and not 0 < self.distance[0] < self.distance[1]:
            raise FlexcalError(
                "E-ROBOT-060", "distance of a camera is its least and its largest distance from the board, m."
            )


@dataclass(frozen=True)
class WireConfig:
    """Draw-wire sensor, or another instrument of distances from a point that stands anywhere in the cell.

    std: standard deviation of a length, m; None where it is not known. scale_std: relative standard deviation of all its lengths together.
    xyz: where it is roughly, m in the base frame, for design.
    """

    kind: Literal["wire"]
    std: float | None = None
    scale_std: float = 1e-3
    xyz: Triple | None = None

    def __post_init__(self) -> None:
        _require_std(self.std)
        if not self.scale_std > 0:
            raise FlexcalError("E-ROBOT-057", f"scale_std must be positive, not {self.scale_std:g}.")


FACES: dict[str, tuple[bool, bool, bool]] = {
    "plane": (False, False, True),
    "line": (True, True, False),
    "sphere": (True, False, False),
}
"""What may be touched, and which coordinates in its axes a contact tells."""


@dataclass(frozen=True)
class FaceConfig:
    """Plane, line or sphere anywhere in the cell that the measured point touches; a plane may be read by a dial gauge.

    std: standard deviation of a contact, m; None where it is not known. For design: xyz, roughly a point of the plane or line, or the
    centre, m in the base frame; normal of the plane, or direction of the line; radius of the sphere with that of the probe, m.
    """

    kind: Literal["plane", "line", "sphere"]
    std: float | None = None
    xyz: Triple | None = None
    normal: Triple = (0.0, 0.0, 1.0)
    radius: float = 0.02

    def __post_init__(self) -> None:
        _require_std(self.std)


@dataclass(frozen=True)
class InclinometerConfig:
    """Inclinometer, or accelerometer of which the readings at rest are used, fixed to a `frame` of the robot.

    rpy: how it is mounted in the frame, rad; found by the calibration, and compared where it is given. reads: "elevation", the angle of an
    axis above the horizontal plane; "projection", that in the plane with the sensor's z axis, atan2(x, z) and atan2(y, z); "component",
    the vertical component of the axis itself, as an accelerometer reads it in units of gravity. All are positive where the axis points
    upwards. std: standard deviation of a reading, rad (1 for components); None where it is not known. range: largest reading of an axis,
    rad (1 for components); None for what the readings can be. level: whether `gravity` is exactly the vertical in the robot's base frame;
    else the base may be inclined.
    """

    kind: Literal["inclinometer"]
    frame: str
    rpy: Triple | None = None
    reads: Literal["elevation", "projection", "component"] = "elevation"
    std: float | None = None
    range: float | None = None
    level: bool = False

    def __post_init__(self) -> None:
        _require_std(self.std, "rad")
        if self.range is not None and not self.range > 0:
            raise FlexcalError("E-ROBOT-078", f"range must be positive, not {self.range:g}.")


def _require_std(std: float | None, unit: str = "m") -> None:
    if std is not None and not std > 0:
        raise FlexcalError("E-ROBOT-056", f"std must be positive, not {std:g} {unit}.")


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
    prior: PriorConfig = PriorConfig()
    drives: DrivesConfig = DrivesConfig()
    elastic: tuple[ElasticConfig, ...] = ()
    bearings: Bearings | None = None
    geometry: GeometryConfig = GeometryConfig()
    dynamics: DynamicsConfig = DynamicsConfig()
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
        if self.tolerance is not None and not self.tolerance > 0:
            raise FlexcalError("E-ROBOT-079", f"tolerance must be positive, not {self.tolerance:g} m.")
