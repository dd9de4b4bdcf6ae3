"""Derivatives of readings by what moves the target on the robot: geometry, loads of springs, twists and tilts of joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.measurement.thermal_columns import expansion_column, rise_of, station_drift_column
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import PointKinematics, relative_motion
from flexcal.model.robot import (
    EXPANSION,
    GEOMETRY,
    HYSTERESIS,
    LATERAL,
    LINK_EXPANSION,
    ORIGIN,
    RATIO,
    SPRINGS,
    STATION_DRIFT,
    ZERO_DRIFT,
    RobotModel,
)
from flexcal.model.statics import (
    carried_mass,
    rotations_by_geometry,
    transmission_columns,
    twist_by_hardening,
    twist_from_torque,
)

if TYPE_CHECKING:
    from flexcal.calibration.measurement.prediction import PredictedMeasurements


@dataclass(frozen=True, eq=False)
class ArmColumns:
    """Columns of the Jacobian of the readings `at` for parameters of the robot, the motion of the deflection included."""

    at: PredictedMeasurements

    def columns(self, names: Sequence[str]) -> np.ndarray:
        """Derivatives (R, 3, p) of the readings by p parameters, natural units; raises `FlexcalError` for one without effect."""
        result = np.empty((len(self.at.readings.row), 3, len(names)))
        places, errors, twists, loads = self.at.model.geometry_columns, {}, {}, {}
        for k, name in enumerate(names):
            owner, _, key = name.rpartition(".")
            kind = "transmission" if key.startswith(("transmission_", RATIO)) else key
            if owner.startswith("point."):
                result[:, :, k] = self._point(owner.removeprefix("point."), key)
            elif name in places:
                errors[k] = places[name]
            elif kind in _TWISTS:
                twists[k] = self.at.model.joint_index(owner), key
            elif kind in _BY_KEY:
                result[:, :, k] = _BY_KEY[kind](self, owner, key)
            else:
                loads[k] = self._load(name)
        if errors:
            result[:, :, as_slice(list(errors))] = self._by_geometry.take(list(errors.values()), axis=2)
        if twists:
            twist = self.at.by_row(self._twists(list(twists.values())))[:, None]
            joints = 6 * np.array([joint for joint, _ in twists.values()])
            result[:, :, as_slice(list(twists))] = twist * self._under_load.take(joints, axis=2)
        if loads:
            load = self.at.by_row(np.stack(list(loads.values()), axis=2))
            result[:, :, as_slice(list(loads))] = np.matmul(self._by_load, load)
        return result

    @cached_property
    def _by_motion(self) -> np.ndarray:
        """Readings (R, 3, N, 3) by a rotation of each joint about x, y, z (a motion along z where prismatic)."""
        motion = self.at.kinematics.motion_jacobian
        moved = self.at.moved(motion.reshape(len(motion), 6, -1))
        return moved.reshape(len(moved), 3, len(self.at.model.joints), 3)

    @cached_property
    def _by_load(self) -> np.ndarray:
        """Readings (R, 3, d) by the load on each elastic coordinate."""
        rest = self.at.rest
        own = self._by_motion[:, :, rest.axes[:, 0], rest.axes[:, 1]]
        return -np.matmul(own, self.at.by_row(rest.compliance))

    @cached_property
    def _under_load(self) -> np.ndarray:
        """Readings (R, 3, G + 6) by the errors of `RobotModel.geometry_columns`, and six of the tool, at the load that joints have."""
        columns = self.at.moved(self.at.kinematics.geometry_jacobian)
        if self.at.rest.axes.size:
            coupling = self.at.by_row(self.at.rest.coupling)
            columns[:, :, : len(self.at.model.geometry_columns)] += np.matmul(self._by_load, coupling)
        return columns

    @cached_property
    def _by_geometry(self) -> np.ndarray:
        """The same with what the errors change of that load; a twist by transmission or backlash changes none."""
        model, poses, columns = self.at.model, self.at.poses, self._under_load
        axes, slopes = rotations_by_geometry(model, poses.q, carried_mass(model, poses.payload, len(poses)))
        if not axes:
            return columns
        # a tilt changes no load on springs either
        moved = [
            columns[:, :, 6 * joint] if component == 2 else self._by_motion[:, :, joint, component]
            for joint, component in axes
        ]
        columns = columns.copy()
        columns[:, :, : slopes.shape[2]] += np.matmul(np.stack(moved, axis=2), self.at.by_row(slopes))
        return columns

    def _point(self, target: str, key: str) -> np.ndarray:
        own = self.at.by_row(self.at.poses.target) == target
        place = self._by_geometry[:, :, len(self.at.model.geometry_columns) + 3 + "xyz".index(key)]
        return np.where(own[:, None], place, 0.0)

    def _tool(self, owner: str, key: str) -> np.ndarray:
        column = self._by_geometry[:, :, len(self.at.model.geometry_columns) + GEOMETRY.index(key)]
        if key.startswith("length"):
            first = self.at.model.tool_point
            return np.where((self.at.by_row(self.at.poses.target) == first)[:, None], column, 0.0)
        return column

    def _origin(self, owner: str, key: str) -> np.ndarray:
        """By a displacement of a joint and all beyond it along an axis of its parent link.

        As by that link's length vector for the targets that the joint moves; the load on springs below shifts with the weight.
        """
        at, model, axis = self.at, self.at.model, ORIGIN.index(key)
        joint = model.joint_index(owner)
        parent, masses = model.joints[joint].parent, model.links.mass
        ends = {name: model.point(name).joint for name in at.poses.targets}
        moved = _shifted(at.target, parent, axis, _beyond(model, joint, ends, at.poses.target))
        if at.carrier is not None:
            carriers = {name: frame.joint for name, frame in model.carriers.items()}
            carried = _beyond(model, joint, carriers, at.poses.station)
            moved = relative_motion(at.target, at.carrier, moved, _shifted(at.carrier, parent, axis, carried))
        moved = at.moved(moved)[:, :, 0]
        if parent < 0 or not at.rest.axes.size:
            return moved
        beyond = [i for i in range(len(model.joints)) if joint in model.path_to(i)]
        weight = np.full(len(at.poses), masses[beyond].sum())
        if model.payload is not None and model.payload.joint in beyond:
            weight += carried_mass(model, at.poses.payload, len(at.poses))
        load = weight[:, None] * at.rest.regressor[:, :, 4 * parent + 1 + axis]
        return moved + np.matmul(self._by_load, at.by_row(load)[:, :, None])[:, :, 0]

    def _hardened(self, owner: str, key: str) -> np.ndarray:
        joint = self.at.model.joint_index(owner.removesuffix(".drive"))
        model, rest = self.at.model, self.at.rest
        hardening = model.springs.hardening[joint]
        twist = twist_from_torque(-rest.torque[:, joint], model.springs.stiffness[joint, 2], hardening)
        turned = self.at.by_row(twist_by_hardening(twist, hardening))
        return turned[:, None] * self._by_motion[:, :, joint, 2]

    def _tilted(self, owner: str, key: str) -> np.ndarray:
        joint = self.at.model.joint_index(owner)
        tilt = self.at.by_row(self.at.lateral[:, joint, LATERAL.index(key)])
        return np.matmul(self._by_motion[:, :, joint, :2], tilt[:, :, None])[:, :, 0]

    def _drifted(self, owner: str, key: str) -> np.ndarray:
        joint = self.at.model.joint_index(owner)
        return self.at.by_row(rise_of(self.at))[:, None] * self._by_motion[:, :, joint, 2]

    def _lagging(self, owner: str, key: str) -> np.ndarray:
        model, approach = self.at.model, self.at.poses.approach
        joint = model.joint_index(owner)
        if approach is None:
            return np.zeros((len(self.at.readings.row), 3))
        side = self.at.by_row(approach[:, model.motors.index(joint)])
        return -side[:, None] * self._by_motion[:, :, joint, 2]

    def _expanded(self, owner: str, key: str) -> np.ndarray:
        return expansion_column(self.at, f"{owner}.{key}")

    def _shifted_station(self, owner: str, key: str) -> np.ndarray:
        return station_drift_column(self.at, f"{owner}.{key}")

    def _twists(self, twists: Sequence[tuple[int, str]]) -> np.ndarray:
        """Motions (N, T) of joints by their backlash, gravity compliance or one wave or ratio of their transmission: joint and key of T."""
        rest, result = self.at.rest, np.empty((len(self.at.poses), len(twists)))
        waves = {k: twist for k, twist in enumerate(twists) if twist[1] not in _SIDES}
        for k, (joint, key) in enumerate(twists):
            if key in _SIDES:
                result[:, k] = -(rest.flank if key == "backlash" else rest.torque)[:, joint]
        if waves:
            result[:, list(waves)] = transmission_columns(
                self.at.model, self.at.poses.q, list(waves.values())
            )
        return result

    def _load(self, name: str) -> np.ndarray:
        """Change of the load on each elastic coordinate (N, d) with a stiffness, mass or centre of mass."""
        owner, _, key = name.rpartition(".")
        model, poses, rest = self.at.model, self.at.poses, self.at.rest
        if key == "stiffness":
            joint_name, _, spring = owner.rpartition(".")
            axis = (model.joint_index(joint_name), SPRINGS.index(spring))
            load = np.zeros(rest.compliance.shape[:2])
            stretch = rest.deflection[:, axis[0], axis[1]]
            if axis[1] == 2:
                stretch = -rest.torque[:, axis[0]] / model.springs.stiffness[axis]
            load[:, [tuple(a) for a in rest.axes].index(axis)] = stretch
            return load
        if key == "mass" or key.startswith("com_"):
            if owner == "payload":
                payload = model.payload
                assert payload is not None
                block = rest.regressor[:, :, 4 * payload.joint : 4 * payload.joint + 4]
                masses = carried_mass(model, poses.payload, len(poses))[:, None]
                if key == "mass":
                    share = masses / payload.mass if payload.mass > 0 else 1.0
                    return share * (block[:, :, 0] + block[:, :, 1:] @ payload.com_in_link)
                return masses * (block[:, :, 1:] @ payload.rotation[:, "xyz".index(key[-1])])
            i = [joint.link for joint in model.joints].index(owner)
            block = rest.regressor[:, :, 4 * i : 4 * i + 4]
            if key == "mass":
                return block[:, :, 0] + block[:, :, 1:] @ model.links.com[i]
            return model.links.mass[i] * block[:, :, 1 + "xyz".index(key[-1])]
        raise FlexcalError("E-CAL-013", f"the position of a point does not depend on '{name}'.")


def as_slice(places: list[int]) -> slice | list[int]:
    """The same places as a slice where they follow each other, which copies several times as fast."""
    first, last = places[0], places[-1] + 1
    return slice(first, last) if places == list(range(first, last)) else places


def _beyond(model: RobotModel, joint: int, ends: Mapping[str, int], names: np.ndarray) -> np.ndarray:
    """Which of the `names` (N,), on the links of the joints `ends`, a joint carries; none of those on no link."""
    carried = {name: joint in model.path_to(end) for name, end in ends.items()}
    return np.array([carried.get(name, False) for name in names.tolist()])


def _shifted(at: PointKinematics, parent: int, axis: int, carried: np.ndarray) -> np.ndarray:
    """Motion (N, 6, 1) of points, where they are `carried` (N,), with a shift along an axis of the link `parent`, -1 for the base."""
    if parent < 0:
        moved = np.broadcast_to(np.eye(6)[axis, :, None], (len(carried), 6, 1))
    else:
        moved = at.geometry_jacobian[:, :, 6 * parent + 3 + axis, None]
    return np.where(carried[:, None, None], moved, 0.0)


_SIDES = ("backlash", "gravity_compliance")
_TWISTS = (*_SIDES, "transmission")
_BY_KEY: Mapping[str, Callable[[ArmColumns, str, str], np.ndarray]] = {
    **dict.fromkeys(GEOMETRY, ArmColumns._tool),
    **dict.fromkeys(ORIGIN, ArmColumns._origin),
    **dict.fromkeys(LATERAL, ArmColumns._tilted),
    "hardening": ArmColumns._hardened,
    EXPANSION.rpartition(".")[2]: ArmColumns._expanded,
    LINK_EXPANSION: ArmColumns._expanded,
    ZERO_DRIFT: ArmColumns._drifted,
    HYSTERESIS: ArmColumns._lagging,
    **dict.fromkeys(STATION_DRIFT, ArmColumns._shifted_station),
}
