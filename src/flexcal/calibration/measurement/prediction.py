"""Predicted measurements at each pose, and their derivatives by all parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.calibration.measurement.instrument_readings import instrument_readings, reading_slopes
from flexcal.calibration.measurement.readings import Readings
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import PointKinematics
from flexcal.model.parts import rotation_vector, skew_matrix, vector_rotation, wxyz_rotation
from flexcal.model.robot import (
    BOARD_SCALE,
    GEOMETRY,
    LATERAL,
    LENS,
    ORIGIN,
    SOCKET_SCALE,
    SPRINGS,
    STATION,
    WIRE_SCALE,
    RobotModel,
)
from flexcal.model.statics import (
    Equilibrium,
    carried_mass,
    force_moments,
    lateral_axes,
    lateral_slopes,
    tool_at_rest,
    twist_by_hardening,
    twist_from_torque,
)
from flexcal.progress import Progress, silent


def require_points(poses: PoseSet, where: str = "the poses") -> None:
    """Raise `FlexcalError` for measurements that are not of whole points; `where` names the files."""
    if poses.kind is not None and (poses.kind != "").any():
        raise FlexcalError(
            "E-CAL-011",
            f"{where}: distances and touches alone do not tell where a point is; give points x, y, z, or compare by "
            "'flexcal calibrate --hold-out COLUMN'.",
        )


_BLOCK = 20_000
"""Number of poses whose predictions are in memory together."""


@dataclass(frozen=True, eq=False)
class PredictedMeasurements:
    """Predicted points at the poses, with the data for their derivatives and for all R `readings`.

    `located` (N, 3), m, are the targets in the instruments' frames, `position` (N, 3) what the instruments read of them: the same where
    they measure coordinates.
    """

    model: RobotModel
    poses: PoseSet
    located: np.ndarray
    position: np.ndarray
    base: np.ndarray
    rest: Equilibrium
    kinematics: PointKinematics

    @cached_property
    def readings(self) -> Readings:
        """What was measured at the poses."""
        return Readings.of(self.poses, reading_slopes(self.poses, self.located))

    def _read(self, moved: np.ndarray) -> np.ndarray:
        """Change (N, 3, …) of what the instruments read with displacements of the targets (N, 3, …) in their axes."""
        slopes = self.readings.slopes
        return (
            moved
            if slopes is None
            else np.matmul(slopes, moved.reshape(len(moved), 3, -1)).reshape(moved.shape)
        )

    @cached_property
    def residual(self) -> np.ndarray:
        """Measured minus predicted (R, 3): points, m, and the rotation vector from predicted to measured axes, rad, both in the
        instrument's frame.
        """
        residual = np.concatenate([self.poses.position - self.position, self._rotations])
        scale = self.model.stations.scale[1]
        if self.poses.seen.any():
            residual[: len(self.poses)] += scale * self.poses.position * self.poses.seen[:, None]
            residual += self._lens_shift
        return residual

    @cached_property
    def _lens_shift(self) -> np.ndarray:
        """Change (R, 3) of the measured poses with the intrinsic parameters, from those that they were measured with.

        None for a camera whose parameters the robot does not have, as before a calibration.
        """
        shift = np.zeros((len(self.readings.row), 3))
        for name, lens in self.poses.lenses.items():
            if name in self.model.lenses.names:
                values = self.model.lenses.values[self.model.lenses.names.index(name)]
                shift += np.matmul(self._by_lenses(name), values - lens.values)
        return shift

    def _by_lenses(self, camera: str) -> np.ndarray:
        """Change (R, 3, 9) of the measured poses with the intrinsic parameters of a camera."""
        own = self.poses.by_lens
        assert own is not None and self.poses.camera is not None
        mine = np.where((self.poses.camera == camera)[:, None, None], own, 0.0)
        return np.concatenate([mine[:, :3], mine[self.poses.turned, 3:]])

    @cached_property
    def orientation(self) -> np.ndarray:
        """Predicted axes (M, 3, 3) of the targets whose orientation was measured, in the instrument's frame."""
        own = self.poses.turned
        axes = np.matmul(self.base[own], self.kinematics.orientation[own])
        for name in dict.fromkeys(self.poses.target[own].tolist()):
            rows = self.poses.target[own] == name
            axes[rows] = axes[rows] @ vector_rotation(self._turn(name))
        return axes

    def _turn(self, target: str) -> np.ndarray:
        return self.model.geometry.point_turn[list(self.model.points).index(target)]

    @cached_property
    def _rotations(self) -> np.ndarray:
        """Rotation vectors (M, 3), rad, from predicted to measured axes."""
        quaternion = self.poses.quaternion_wxyz
        if quaternion is None or not self.poses.turned.any():
            return np.zeros((0, 3))
        measured = wxyz_rotation(quaternion[self.poses.turned])
        return rotation_vector(np.matmul(measured, np.swapaxes(self.orientation, 1, 2)))

    @cached_property
    def _rotating(self) -> np.ndarray:
        """Change (M, 3, 3) of the negative rotation vectors with a rotation of the predicted axes about the instrument's."""
        return inverse_right_jacobians(self._rotations)

    def _by_tool(self, columns: np.ndarray) -> np.ndarray:
        """Readings (R, 3, k) from motions of the targets, `columns` (N, 6, k) in the base frame."""
        moved = self._read(np.matmul(self.base, columns[:, :3]))
        if not self.readings.turns:
            return moved
        own = self.poses.turned
        return np.concatenate([moved, np.matmul(self._rotating @ self.base[own], columns[own, 3:])])

    def _by_row(self, values: np.ndarray) -> np.ndarray:
        """Values (N, …) of the poses at each reading, (R, …)."""
        return values if not self.readings.turns else values[self.readings.row]

    def jacobian(self, names: Sequence[str]) -> np.ndarray:
        """∂reading/∂parameter (R, 3, len(names)) in natural units, the motion of the deflection included.

        Raises `FlexcalError` for a name without effect on the readings.
        """
        readings, n = self.readings, self.model.n
        result = np.zeros((len(readings.row), 3, len(names)))
        samples = len(self.position)
        by_motion = self._by_tool(self.kinematics.motion_jacobian.reshape(samples, 6, -1))
        by_motion = by_motion.reshape(len(result), 3, n, 3)
        by_load = -np.matmul(
            by_motion[:, :, self.rest.axes[:, 0], self.rest.axes[:, 1]], self._by_row(self.rest.compliance)
        )
        by_geometry = self._by_tool(self.kinematics.geometry_jacobian)
        by_geometry[:, :, : 6 * n] += np.matmul(by_load, self._by_row(self.rest.coupling))
        owners = [*self.model.joint_names, "tool"]
        first = next(iter(self.model.points))
        target = self._by_row(self.poses.target)
        for k, name in enumerate(names):
            owner, _, key = name.rpartition(".")
            if name == SOCKET_SCALE:
                result[:samples, :, k] = -np.where(self.poses.in_socket[:, None], self.poses.position, 0.0)
            elif name == WIRE_SCALE:
                result[:samples, :, k] = -np.where(self.poses.far[:, None], self.poses.position, 0.0)
            elif name == BOARD_SCALE:
                result[:samples, :, k] = -self.poses.position * self.poses.seen[:, None]
            elif owner.startswith("camera."):
                result[:, :, k] = -self._by_lenses(owner.removeprefix("camera."))[:, :, LENS.index(key)]
            elif owner.startswith("station.") and key == "zero":
                own = self.poses.far & (self.poses.station == owner.removeprefix("station."))
                result[np.flatnonzero(own), 0, k] = -1.0
            elif owner.startswith("station.") and key in STATION:
                result[:, :, k] = self._by_station(owner.removeprefix("station."), key)
            elif owner.startswith("point.") and key in STATION[3:]:
                result[samples:, :, k] = self._by_turn(owner.removeprefix("point."), key)
            elif owner.startswith("point."):
                own = target == owner.removeprefix("point.")
                result[own, :, k] = by_geometry[own, :, 6 * n + 3 + "xyz".index(key)]
            elif key in GEOMETRY:
                result[:, :, k] = by_geometry[:, :, 6 * owners.index(owner) + GEOMETRY.index(key)]
                if owner == "tool" and key.startswith("length"):
                    result[target != first, :, k] = 0.0
            elif key in ORIGIN:
                i = self.model.joint_index(owner)
                result[:, :, k] = self._by_origin(i, ORIGIN.index(key), by_load)
            elif key in ("backlash", "gravity_compliance") or key.startswith("transmission_"):
                i = self.model.joint_index(owner)
                result[:, :, k] = self._by_row(self._twist(i, key))[:, None] * by_geometry[:, :, 6 * i]
            elif key == "hardening":
                i = self.model.joint_index(owner.removesuffix(".drive"))
                result[:, :, k] = self._by_row(self._twist(i, key))[:, None] * by_motion[:, :, i, 2]
            elif key in LATERAL:
                i = self.model.joint_index(owner)
                tilt = self._by_row(self._lateral[:, i, LATERAL.index(key)])
                result[:, :, k] = np.matmul(by_motion[:, :, i, :2], tilt[:, :, None])[:, :, 0]
            else:
                result[:, :, k] = np.matmul(by_load, self._by_row(self.load(name))[:, :, None])[:, :, 0]
        return result

    def _by_origin(self, joint: int, axis: int, by_load: np.ndarray) -> np.ndarray:
        """Derivative (R, 3) of the readings by a displacement of a joint and all beyond it along an axis of its parent link.

        As by that link's length vector for the targets that the joint moves; the load on springs below shifts with the weight.
        """
        parent, masses = self.model.joints[joint].parent, self.model.links.mass
        paths = {name: self.model.path_to(self.model.point(name).joint) for name in self.poses.targets}
        carried = np.array([joint in paths[name] for name in self.poses.target.tolist()])
        if parent < 0:
            moved = np.broadcast_to(np.eye(6)[axis, :, None], (len(carried), 6, 1))
        else:
            column = 6 * parent + 3 + axis
            moved = self.kinematics.geometry_jacobian[:, :, column : column + 1]
        moved = self._by_tool(np.where(carried[:, None, None], moved, 0.0))[:, :, 0]
        if parent < 0 or not self.rest.axes.size:
            return moved
        beyond = [i for i in range(self.model.n) if joint in self.model.path_to(i)]
        weight = np.full(len(carried), masses[beyond].sum())
        if self.model.payload is not None and self.model.payload.joint in beyond:
            weight += carried_mass(self.model, self.poses.payload, len(self.poses))
        load = weight[:, None] * self.rest.regressor[:, :, 4 * parent + 1 + axis]
        return moved + np.matmul(by_load, self._by_row(load)[:, :, None])[:, :, 0]

    def _twist(self, joint: int, key: str) -> np.ndarray:
        """Rotation (N,) of a joint by its backlash, gravity compliance, hardening or one wave of its transmission error."""
        if key == "hardening":
            hardening = self.model.springs.hardening[joint]
            twist = twist_from_torque(
                -self.rest.torque[:, joint], self.model.springs.stiffness[joint, 2], hardening
            )
            return twist_by_hardening(twist, hardening)
        if key == "backlash":
            return -self.rest.flank[:, joint]
        if key == "gravity_compliance":
            return -self.rest.torque[:, joint]
        order, wave = key.split("_")[1:]
        phase = int(order) * self.poses.q[:, joint]
        return np.sin(phase) if wave == "sin" else np.cos(phase)

    @cached_property
    def _lateral(self) -> np.ndarray:
        """Tilt about the bearing's x and y (N, n, axis, 2) of every joint by its lateral compliances, rad per rad/(N m)."""
        masses = carried_mass(self.model, self.poses.payload, len(self.poses))
        slopes = lateral_slopes(self.model, self.poses.q, masses)
        if self.poses.force is not None:
            axes = lateral_axes(self.model, self.poses.q)
            moments = force_moments(self.kinematics, self.poses.force)[:, :, :2]
            slopes = slopes + np.matmul(axes, moments[:, :, :, None]) * axes
        return slopes

    def _by_station(self, station: str, key: str) -> np.ndarray:
        """Derivative (R, 3) of the readings by one number of a station's pose."""
        own, turned = self.poses.station == station, self.poses.turned
        if key in ("x", "y", "z"):
            moved = self._read(own[:, None] * np.eye(3)["xyz".index(key)])
            return np.concatenate([moved, np.zeros((int(turned.sum()), 3))])
        values = [self.model.value(f"station.{station}.{k}") for k in STATION]
        arm = self.located - np.array(values[:3])
        axis = left_jacobian(np.array(values[3:]))[:, "xyz".index(key[1])]
        return np.concatenate(
            [self._read(own[:, None] * np.cross(axis, arm)), own[turned][:, None] * (self._rotating @ axis)]
        )

    def _by_turn(self, target: str, key: str) -> np.ndarray:
        """Derivative (M, 3) of the measured orientations by one coordinate of the rotation vector of a target's axes."""
        turn, own = self._turn(target), self.poses.target[self.poses.turned] == target
        # R exp(v + dv) = exp(R Jr(v) dv) R for the predicted axes R exp(v), with Jr(v) = exp(-v) Jl(v)
        axis = vector_rotation(-turn) @ left_jacobian(turn)[:, "xyz".index(key[1])]
        return own[:, None] * np.matmul(self._rotating @ self.orientation, axis)

    def load(self, name: str) -> np.ndarray:
        """Change of the load on each elastic coordinate (N, d) with a stiffness, mass or centre of mass."""
        owner, _, key = name.rpartition(".")
        if key == "stiffness":
            joint_name, _, spring = owner.rpartition(".")
            axis = (self.model.joint_index(joint_name), SPRINGS.index(spring))
            load = np.zeros(self.rest.compliance.shape[:2])
            stretch = self.rest.deflection[:, axis[0], axis[1]]
            if axis[1] == 2:
                stretch = -self.rest.torque[:, axis[0]] / self.model.springs.stiffness[axis]
            load[:, [tuple(a) for a in self.rest.axes].index(axis)] = stretch
            return load
        if key == "mass" or key.startswith("com_"):
            if owner == "payload":
                payload = self.model.payload
                assert payload is not None
                block = self.rest.regressor[:, :, 4 * payload.joint : 4 * payload.joint + 4]
                masses = carried_mass(self.model, self.poses.payload, len(self.poses))[:, None]
                if key == "mass":
                    share = masses / payload.mass if payload.mass > 0 else 1.0
                    return share * (block[:, :, 0] + block[:, :, 1:] @ payload.com_in_link)
                return masses * (block[:, :, 1:] @ payload.rotation[:, "xyz".index(key[-1])])
            i = [joint.link for joint in self.model.joints].index(owner)
            block = self.rest.regressor[:, :, 4 * i : 4 * i + 4]
            if key == "mass":
                return block[:, :, 0] + block[:, :, 1:] @ self.model.links.com[i]
            return self.model.links.mass[i] * block[:, :, 1 + "xyz".index(key[-1])]
        raise FlexcalError("E-CAL-013", f"the position of a point does not depend on '{name}'.")


def _scaled(model: RobotModel, poses: PoseSet) -> np.ndarray:
    """Shift (N, 3), m, of sockets from their declared positions in the fixture, and of lengths, by the deviation of their scales."""
    sockets, _, wires = model.stations.scale
    return (sockets * poses.in_socket + wires * poses.far)[:, None] * poses.position


def left_jacobian(vector: np.ndarray) -> np.ndarray:
    """Left Jacobian (3, 3) of a rotation vector (3,): rotation in fixed axes per change of the vector."""
    angle = float(np.linalg.norm(vector))
    skew = skew_matrix(vector)
    if angle < 1e-8:
        return np.eye(3) + skew / 2
    return (
        np.eye(3) + (1 - np.cos(angle)) / angle**2 * skew + (angle - np.sin(angle)) / angle**3 * skew @ skew
    )


def inverse_right_jacobians(vectors: np.ndarray) -> np.ndarray:
    """Inverse right Jacobians (N, 3, 3) of rotation vectors (N, 3): change of the vector with a rotation in the turned axes."""
    angle = np.linalg.norm(vectors, axis=1)
    half = np.maximum(angle, 1e-6) / 2
    factor = np.where(angle < 1e-6, 1 / 12, (1 - half / np.tan(half)) / (4 * half**2))
    skew = np.cross(vectors[:, None, :], np.eye(3)).swapaxes(1, 2)
    return np.eye(3) + skew / 2 + factor[:, None, None] * (skew @ skew)


def predict_measurements(
    model: RobotModel,
    poses: PoseSet,
    *,
    flank: np.ndarray | None = None,
    elastic: bool = True,
    jacobians: bool = False,
) -> PredictedMeasurements:
    """Predicted positions of the target of every pose in the instrument's frame, for the deflected, calibrated robot.

    `flank` (N, n) fixes the side of the backlash; without, the drive torque at rest decides. Without `elastic` the arm is rigid.
    Raises `FlexcalError` for unknown targets and stations, and payloads without a declaration.
    """
    tool = tool_at_rest(
        model,
        poses.q,
        poses.payload,
        poses.target,
        flank=flank,
        elastic=elastic,
        jacobians=jacobians,
        force=poses.force,
    )
    at, base = np.empty((len(poses), 3)), np.empty((len(poses), 3, 3))
    for name in poses.stations:
        own, place = poses.station == name, model.stations.pose[model.station_index(name)]
        at[own], base[own] = place[:3], vector_rotation(place[3:])
    located = np.matmul(base, tool.kinematics.position[:, :, None])[:, :, 0] + at
    position = instrument_readings(model, poses, located)
    if model.stations.scale.any():
        position = position - _scaled(model, poses)
    return PredictedMeasurements(model, poses, located, position, base, tool.rest, tool.kinematics)


def predicted_positions(
    model: RobotModel, poses: PoseSet, *, elastic: bool = True, progress: Progress = silent
) -> np.ndarray:
    """Positions (N, 3) of `predict_measurements`, m, for any number of poses, block by block."""
    parts = [np.zeros((0, 3))]
    for first in range(0, len(poses), _BLOCK):
        progress("all points", first / len(poses))
        parts.append(
            predict_measurements(model, poses.subset(slice(first, first + _BLOCK)), elastic=elastic).position
        )
    progress("all points", 1.0)
    return np.concatenate(parts)
