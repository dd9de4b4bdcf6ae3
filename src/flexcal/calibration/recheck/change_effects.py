"""Changes that a robot or its set-up may have undergone, with their effect on measured points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexcal.calibration.measurement import (
    PredictedMeasurements,
    covariance_root,
    moving_parameters,
    predict_measurements,
    sag_columns,
    with_load_at,
)
from flexcal.model.robot import GEOMETRY, LATERAL, STATION, RobotModel

ChangeKind = Literal[
    "joint_shifted",
    "tool_bumped",
    "thermal_growth",
    "payload_changed",
    "joint_softer",
    "instrument_moved",
    "wrong_reading",
    "readings_drift",
    "noisier_readings",
    "gear_worn",
    "two_changes",
]
_NO_LOAD = 1e-4
"""Gravity torque, relative to the largest of the arm, that presses a gear to neither side."""
_STEP = 0.1
"""Payload, kg, of the finite difference."""
_NO_EFFECT = 1e-12
"""Effect of a unit of a change, m, below which it moves no point."""
_SHARE = 0.1
"""Step of a compliance, in its standard deviations, of the finite difference."""
_ANYWHERE = 0.1
"""Standard deviation, m, of the centre of mass of a load that is not declared, about the measured point."""
_YIELDING = ("gravity_compliance", *LATERAL, "stiffness", "hardening")
"""Parameters by which an arm yields to a load."""


@dataclass(frozen=True, eq=False)
class PossibleChange:
    """Change of one `kind`: of `subject`, a joint, a point on the tool, a station or a pose, by parameters `names` in `units`.

    `columns` (3 K, k) are the derivatives of the measured points, m per unit; `spread` (3 K, p) are roots of the covariance of the
    column of a single parameter, as of a load on compliances that are known to some per cent, None for columns that are known. Two
    changes together have these two as `parts`, and the columns of both.
    """

    kind: ChangeKind
    subject: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    columns: np.ndarray
    spread: np.ndarray | None = None
    parts: tuple[PossibleChange, ...] = ()

    @classmethod
    def of_two(cls, one: PossibleChange, other: PossibleChange) -> PossibleChange:
        """Both changes at once."""
        return cls(
            "two_changes",
            f"{one.subject} and {other.subject}",
            one.names + other.names,
            one.units + other.units,
            np.hstack([one.columns, other.columns]),
            parts=(one, other),
        )

    def spread_at(self, estimate: np.ndarray) -> np.ndarray:
        """Roots (3 K, p), m, of the covariance of the effect of an `estimate` (k,), as the columns are known."""
        if self.parts:
            count = len(self.parts[0].names)
            halves = zip(self.parts, (estimate[:count], estimate[count:]), strict=True)
            return np.hstack([part.spread_at(own) for part, own in halves])
        return np.zeros((len(self.columns), 0)) if self.spread is None else estimate[0] * self.spread


def possible_changes(model: RobotModel, at: PredictedMeasurements) -> list[PossibleChange]:
    """Changes of single joints, of the tool, of all lengths, of the load and of the instrument's place at predicted points.

    Joints that move no point are left out, and so is the compliance of joints without a gravity torque.
    """
    changes = [
        PossibleChange(
            "joint_shifted",
            joint.name,
            (f"{joint.name}.offset",),
            ("m" if joint.kind == "prismatic" else "rad",),
            _flat(at.jacobian([f"{joint.name}.offset"])),
        )
        for joint in model.motor_joints
    ]
    changes += [_tool(model, at, target) for target in at.poses.targets]
    changes += _whole_tool(model, at)
    if at.carrier is None:
        grown = np.zeros((len(at.poses), 6, 1))
        grown[:, :3, 0] = at.kinematics.position
        changes.append(
            PossibleChange("thermal_growth", "all lengths", ("growth",), ("m/m",), _flat(at.moved(grown)))
        )
    changes += [_payload(model, at), *_softer(model, at)]
    for station in at.poses.stations:
        names = tuple(f"station.{station}.{key}" for key in STATION)
        changes.append(
            PossibleChange(
                "instrument_moved",
                station,
                names,
                ("m",) * 3 + ("rad",) * 3,
                _flat(at.jacobian(names)),
            )
        )
    return [change for change in changes if np.abs(change.columns).max(initial=0.0) > _NO_EFFECT]


def wrong_readings(poses: int, numbers: np.ndarray) -> list[PossibleChange]:
    """A wrong reading of each of the poses, whose numbers are (K,)."""
    eye = np.eye(3 * poses)
    return [
        PossibleChange(
            "wrong_reading", str(number), ("dx", "dy", "dz"), ("m",) * 3, eye[:, 3 * k : 3 * k + 3]
        )
        for k, number in enumerate(numbers.tolist())
    ]


def drift_of_readings(poses: int) -> PossibleChange:
    """A drift of instrument or robot while the visit was measured, at constant rate over its K poses in measuring order, from none at the
    first; its parameters are what it comes to at the last.
    """
    columns = np.kron(np.linspace(0.0, 1.0, poses)[:, None], np.eye(3))
    return PossibleChange("readings_drift", "the readings", ("dx", "dy", "dz"), ("m",) * 3, columns)


def noisier_readings(poses: int) -> PossibleChange:
    """More scatter of the readings of K poses by a factor; it moves no point."""
    return PossibleChange("noisier_readings", "the readings", ("scatter",), ("1",), np.zeros((3 * poses, 1)))


def worn_gears(model: RobotModel, at: PredictedMeasurements) -> list[PossibleChange]:
    """Play in the gear of every joint, by half of it: the arm lies on the flank to which gravity presses it.

    Joints that gravity presses to one side alone, or to none, are left out: play there is another zero.
    """
    torque = at.rest.torque
    least = _NO_LOAD * np.abs(torque).max(initial=0.0)
    changes = []
    for joint in model.motor_joints:
        load = torque[:, model.joint_index(joint.name)]
        # gravity turns the arm against the torque that holds it
        side = np.where(np.abs(load) > least, -np.sign(load), 0.0)
        if not ((side > 0).any() and (side < 0).any()):
            continue
        columns = _flat(at.jacobian([f"{joint.name}.offset"])) * np.repeat(side, 3)[:, None]
        unit = "m" if joint.kind == "prismatic" else "rad"
        changes.append(PossibleChange("gear_worn", joint.name, (f"{joint.name}.backlash",), (unit,), columns))
    return changes


def _flat(columns: np.ndarray) -> np.ndarray:
    return columns.reshape(-1, columns.shape[2])


def _place(model: RobotModel, target: str) -> list[str]:
    """Parameters of the place of a point on the tool."""
    if target == model.tool_point:
        return [f"tool.{key}" for key in GEOMETRY if key.startswith("length")]
    return [f"point.{target}.{axis}" for axis in "xyz"]


def _tool(model: RobotModel, at: PredictedMeasurements, target: str) -> PossibleChange:
    columns = _flat(at.jacobian(_place(model, target)))
    own = np.repeat(at.poses.target == target, 3)
    return PossibleChange(
        "tool_bumped", target, tuple(_place(model, target)), ("m",) * 3, columns * own[:, None]
    )


WHOLE_TOOL = "the tool"
"""Subject of a motion of all points on the tool together."""
OF_THE_MEASUREMENT = ("instrument_moved", "wrong_reading", "readings_drift", "noisier_readings")
"""Kinds of changes that leave the tool where it was."""


def _whole_tool(model: RobotModel, at: PredictedMeasurements) -> list[PossibleChange]:
    """Motion of all points on the tool together, about the first, where several in one frame were measured."""
    targets = at.poses.targets
    if len(targets) < 2 or len({model.points[name].frame for name in targets}) > 1:
        return []
    columns = np.zeros((3 * len(at.poses), 6))
    for target, place in zip(targets, _places(model, at), strict=True):
        moved = _tool(model, at, target).columns
        columns += np.hstack([moved, moved @ np.cross(np.eye(3), place).T])
    names = tuple(f"tool.{key}" for key in STATION)
    return [PossibleChange("tool_bumped", WHOLE_TOOL, names, ("m",) * 3 + ("rad",) * 3, columns)]


def _places(model: RobotModel, at: PredictedMeasurements) -> np.ndarray:
    """Places (T, 3), m, of the calibrated points relative to the first, in the axes of their frame."""
    targets = at.poses.targets
    together = at.poses.subset(np.zeros(len(targets), dtype=int))
    there = predict_measurements(model, replace(together, target=np.array(targets)), jacobians=True)
    axes = there.jacobian(_place(model, targets[0]))[0]
    return (there.position - there.position[0]) @ axes


def _payload(model: RobotModel, at: PredictedMeasurements) -> PossibleChange:
    """Change of the mass, kg, of the declared payload, or else of a load at the first measured point."""
    told = model.payload is not None
    subject = "payload" if told else at.poses.targets[0]
    robot = with_load_at(model, at.poses.targets[0])
    column = _by_mass(robot, at)
    if np.abs(column).max() < _NO_EFFECT:
        return _payload_of_rigid_arm(robot, at, subject)
    names = [n for n in moving_parameters(model) if n.rpartition(".")[2] in _YIELDING]
    roots = covariance_root(model, names) if names else np.zeros((0, 0))
    spread = [np.zeros((len(column), 0))]
    if names:
        steps = _SHARE * np.linalg.norm(roots, axis=1)
        slopes = [
            (_by_mass(robot.with_values({name: robot.value(name) + step}), at) - column) / step
            if step > 0
            else np.zeros_like(column)
            for name, step in zip(names, steps.tolist(), strict=True)
        ]
        spread.append(np.hstack(slopes) @ roots)
    if not told:
        # lever arms are linear in the place
        spread += [_by_mass(_displaced(robot, _ANYWHERE * axis), at) - column for axis in np.eye(3)]
    return PossibleChange("payload_changed", subject, ("payload.mass",), ("kg",), column, np.hstack(spread))


def _payload_of_rigid_arm(model: RobotModel, at: PredictedMeasurements, subject: str) -> PossibleChange:
    """Change of the load on an arm whose compliances are not calibrated: its mass times the compliance of the joints, by which each joint
    yields in proportion to the torque of the load, known to 100 %.
    """
    spread = sag_columns(model, at)
    column = spread.sum(axis=1, keepdims=True)
    return PossibleChange("payload_changed", subject, ("payload.sag",), ("kg µrad/(N m)",), column, spread)


def _displaced(model: RobotModel, by: np.ndarray) -> RobotModel:
    """The robot with its payload's centre of mass displaced, m."""
    assert model.payload is not None
    return replace(model, payload=replace(model.payload, com=model.payload.com + by))


def _by_mass(model: RobotModel, at: PredictedMeasurements) -> np.ndarray:
    """Derivative (3 K, 1) of the points by the mass of the payload, m/kg."""
    assert model.payload is not None
    poses = at.poses
    mass = np.full(len(poses), model.payload.mass) if poses.payload is None else poses.payload
    heavier = predict_measurements(model, replace(poses, payload=mass + _STEP)).position
    lighter = predict_measurements(model, replace(poses, payload=mass)).position
    return (heavier - lighter).reshape(-1, 1) / _STEP


def _softer(model: RobotModel, at: PredictedMeasurements) -> list[PossibleChange]:
    """Further compliance of single joints about their axes, rad/(N m), by the gravity torque of the masses that are known."""
    return [
        PossibleChange(
            "joint_softer",
            joint.name,
            (name := f"{joint.name}.gravity_compliance",),
            ("rad/(N m)",),
            _flat(at.jacobian([name])),
        )
        for joint in model.motor_joints
        if joint.kind == "revolute"
    ]
