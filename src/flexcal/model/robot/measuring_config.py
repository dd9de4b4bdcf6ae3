"""Blocks of robot.yaml on what is measured, and by what."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from flexcal.errors import FlexcalError
from flexcal.units import LEAST_STD

Triple = tuple[float, float, float]

_FARTHEST = 10.0
"""Largest coordinate of a point on a tool, m."""


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

    def __post_init__(self) -> None:
        if (far := max(map(abs, self.xyz))) > _FARTHEST:
            raise FlexcalError(
                "E-ROBOT-083",
                f"a point {far:g} m from its frame is on no tool; give its xyz in metres, not millimetres.",
            )


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
    """Place `xyz` (m) of the measuring instrument in the robot's base frame, for planning only; the calibration estimates it.

    `frame`: URDF frame that carries the instrument, or a touched sphere, as the hand of another arm; `xyz` is then its nominal place in
    the axes of that frame, from where the estimated one counts.
    """

    xyz: Triple | None = None
    line_of_sight: bool = False
    frame: str | None = None

    def __post_init__(self) -> None:
        if self.line_of_sight and self.in_base is None:
            raise FlexcalError("E-ROBOT-020", "line_of_sight needs the station's xyz (m in the base frame).")

    @property
    def in_base(self) -> Triple | None:
        """Declared place in the base frame, m; None where there is none, and for an instrument on the robot."""
        return self.xyz if self.frame is None else None


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
        if not self.std >= LEAST_STD:
            raise FlexcalError(
                "E-ROBOT-051", f"std must be positive, at least {LEAST_STD:g}, not {self.std:g} m."
            )

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
        if not self.std >= LEAST_STD:
            raise FlexcalError(
                "E-ROBOT-054", f"std of a board must be positive, at least {LEAST_STD:g}, not {self.std:g}."
            )


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
    if std is not None and not std >= LEAST_STD:
        raise FlexcalError(
            "E-ROBOT-056", f"std must be positive, at least {LEAST_STD:g}, not {std:g} {unit}."
        )
