"""Groups of a robot's parameters: geometry, springs, drives, links, stations and scatter; n joints, SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from flexcal.model.parts import Inertia


@dataclass(frozen=True, eq=False)
class Geometry:
    """Geometric deviations from the URDF, and compliances of rigid joints.

    `errors` (n, 6) of every joint and `tool` (6,) in the order of `GEOMETRY`, rad and m; `origin_error` (n, 3), m, of joints that branch
    off, in the parent link, zero for others; `point_error` (points, 3), m, in the order of
    the robot's points; `point_turn` (points, 3), rad, rotation vectors from the points' frames to the axes of a target whose orientation is
    measured; `point_zero` (points, 3), rad, what an inclinometer's axes read where they are level; `gravity_compliance` (n,) about the
    joints' axes and `lateral_compliance` (n, 2) across them, rad/(N m); `loops` (loops, 6), m, in the order of `LOOP`. The lengths of
    `tool` are the error of the place of `tool_point` alone, or of the first point where none is named.
    """

    errors: np.ndarray
    origin_error: np.ndarray
    tool: np.ndarray
    point_error: np.ndarray
    point_turn: np.ndarray
    point_zero: np.ndarray
    gravity_compliance: np.ndarray
    lateral_compliance: np.ndarray
    loops: np.ndarray
    tool_point: str = ""


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs of the elastic joints.

    `bearing_frames`: joint index → axes (3, 3) of its bearing in the link frame; its keys are the elastic joints. `stiffness` (n, 3),
    N m/rad, and `damping` (n, 3), N m s/rad, in the order of `SPRINGS`, NaN where there is no spring; `hardening` (n,) of the drive
    springs, 1; `braked`: indices of the elastic joints whose motors are braked.
    """

    bearing_frames: Mapping[int, np.ndarray]
    stiffness: np.ndarray
    damping: np.ndarray
    hardening: np.ndarray
    braked: frozenset[int] = frozenset()


@dataclass(frozen=True, eq=False)
class Drives:
    """Parameters of motors, transmissions and friction; in N, m, kg for a prismatic joint.

    (n,) each: `rotor_inertia`, kg m², of the motors at the joint; `held_inertia`, kg m², that moves with the arm of a braked joint beyond
    its links'; `viscous`, N m s/rad, and `coulomb`, N m, friction; `torque_offset`, N m; `delay` of the torque signal, s; `drive_gain`,
    true torque over that of the log; `ratio`, motor turns per joint turn; `backlash`, half the gap, rad; `hysteresis`,
    half its width, by which the arm lags behind the last motion of its motor, rad. `friction` (n, terms) in the order
    of `FRICTION_PARAMETERS`; `parallel` (n, 3), springs and cables beside the motor, in that of `PARALLEL`; `coupling` (declared couplings,
    3) in that of `COUPLED`. `transmission` (n, harmonics, 2), rad: sine and cosine of the transmission errors of the orders `harmonics`;
    `ratio_error` (n, n): what a joint moves beyond what is declared per motion of another, or of its own motor. NaN where robot.yaml gives
    no value.
    """

    rotor_inertia: np.ndarray
    held_inertia: np.ndarray
    viscous: np.ndarray
    coulomb: np.ndarray
    torque_offset: np.ndarray
    friction: np.ndarray
    parallel: np.ndarray
    coupling: np.ndarray
    delay: np.ndarray
    drive_gain: np.ndarray
    ratio: np.ndarray
    backlash: np.ndarray
    hysteresis: np.ndarray
    transmission: np.ndarray
    ratio_error: np.ndarray
    harmonics: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Links:
    """Inertial parameters of the joints' links.

    `mass` (n,), kg; `com` (n, 3), centre of mass in the link frame, m; `inertia` (n, 3, 3) about it in link axes, kg m².
    """

    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray

    @classmethod
    def of(cls, inertias: Sequence[Inertia]) -> Links:
        """Parameters of links with the given inertias."""
        return cls(
            np.array([link.mass for link in inertias]),
            np.array([link.com for link in inertias]),
            np.array([link.inertia for link in inertias]),
        )


@dataclass(frozen=True, eq=False)
class Stations:
    """Poses of the measuring instrument: `names`, and `pose` (stations, 6) as x, y, z, m, and the rotation vector rx, ry, rz, rad.

    Each place of a fixture with sockets is a station too, which measures where the ball is in the fixture, and so is a wire's anchor or a
    touched face. `zero` (stations,), m: distance from the station's origin at which an instrument of distances reads zero, as the radius
    of a touched sphere. `wire_scale` (stations,): relative deviation of the lengths that a wire reads from the true ones, as a drum of
    another radius has it. `board_scale` (1,): relative deviation of the size of a camera's board from the declared one, `socket_scale`
    (fixtures,) of the distances between the sockets of each of the `fixtures` that robot.yaml declares. `drift` (stations, 3), m/K: what
    an instrument's readings shift by per kelvin, in its own frame.
    """

    names: tuple[str, ...]
    pose: np.ndarray
    zero: np.ndarray
    wire_scale: np.ndarray
    board_scale: np.ndarray
    fixtures: tuple[str, ...]
    socket_scale: np.ndarray
    drift: np.ndarray

    @classmethod
    def at_base(cls, names: Sequence[str], fixtures: Sequence[str] = ()) -> Stations:
        """Stations in the robot's base frame, and `fixtures` as declared."""
        number = len(names)
        return cls(
            tuple(names),
            pose=np.zeros((number, 6)),
            zero=np.zeros(number),
            wire_scale=np.zeros(number),
            board_scale=np.zeros(1),
            fixtures=tuple(fixtures),
            socket_scale=np.zeros(len(fixtures)),
            drift=np.zeros((number, 3)),
        )


@dataclass(frozen=True, eq=False)
class Scatter:
    """Scatter of measured points: `std` (8,) of its causes in the order of `SCATTER`, m and rad; `instrument_share` is a ratio.

    `joints` (n,), rad, where points of one pose told the joints apart, whose root mean square `angular` then is; zero where not.
    """

    std: np.ndarray
    joints: np.ndarray

    def turns(self, angular: float) -> np.ndarray:
        """Scatter (n,) of each joint, rad: its own, or that of all."""
        return np.where(self.joints > 0, self.joints, angular)


@dataclass(frozen=True, eq=False)
class Thermal:
    """Thermal expansion of the arm, and drift of its joint zeros.

    `expansion` (1,), 1/K: linear expansion coefficient of the whole arm; `link_expansion` (n,), 1/K: what that of each joint's link differs
    from it by; `zero_drift` (n,), rad/K or m/K: what each joint moves by per kelvin with its motor still; `reference` (1,), in the unit of
    the column `temperature`, °C: the temperature at which all other parameters hold, NaN where none is known.
    """

    expansion: np.ndarray
    link_expansion: np.ndarray
    zero_drift: np.ndarray
    reference: np.ndarray

    @classmethod
    def at_reference(cls, joints: int, reference: float | None) -> Thermal:
        """Arm of so many `joints` that does not change with temperature."""
        known = np.array([np.nan if reference is None else reference])
        return cls(np.zeros(1), np.zeros(joints), np.zeros(joints), known)


@dataclass(frozen=True, eq=False)
class Lenses:
    """Intrinsic parameters of cameras: `names`, and `values` (cameras, 9) in the order of `LENS`, pixels and 1."""

    names: tuple[str, ...]
    values: np.ndarray


Group = Literal["geometry", "springs", "drives", "links", "stations", "scatter", "thermal", "lenses"]
"""Groups of arrays of a robot model."""


class Location(NamedTuple):
    """Place of a named parameter in a robot model: group, array of that group, indices into the array."""

    group: Group
    array: str
    indices: tuple[int, ...]
