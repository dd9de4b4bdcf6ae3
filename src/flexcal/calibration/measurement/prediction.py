"""Predicted measurements at each pose, and their derivatives by all parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.model.kinematics import PointKinematics
from flexcal.model.parts import skew_matrix, vector_rotation
from flexcal.model.robot import GEOMETRY, LATERAL, SOCKET_SCALE, SPRINGS, STATION, RobotModel
from flexcal.model.statics import (
    Equilibrium,
    carried_mass,
    lateral_slopes,
    tool_at_rest,
    twist_by_hardening,
    twist_from_torque,
)
from flexcal.progress import Progress, silent


def require_points(poses: PoseSet, where: str = "the poses") -> None:
    """Raise `FlexcalError` for measured quantities other than points, which would be ignored; `where` names the files."""
    if poses.length is not None:
        raise FlexcalError(
            "E-CAL-011", f"{where}: lengths of a wire cannot be used yet; give points x, y, z."
        )
    if poses.quaternion_wxyz is not None:
        raise FlexcalError(
            "E-CAL-012",
            f"{where}: measured orientations cannot be used yet; take out the columns qw, qx, qy, qz to use the points alone.",
        )


_BLOCK = 20_000
"""Number of poses whose predictions are in memory together."""


@dataclass(frozen=True, eq=False)
class PredictedMeasurements:
    """Predicted points (N, 3) in the instrument's frame at the poses, with the data for their derivatives."""

    model: RobotModel
    poses: PoseSet
    position: np.ndarray
    base: np.ndarray
    rest: Equilibrium
    kinematics: PointKinematics

    def jacobian(self, names: Sequence[str]) -> np.ndarray:
        """∂position/∂parameter (N, 3, len(names)) in natural units, the motion of the deflection included.

        Raises `FlexcalError` for a name without effect on points.
        """
        result = np.zeros((len(self.position), 3, len(names)))
        by_motion = self._turned(self.kinematics.motion_jacobian[:, :3].reshape(len(self.position), 3, -1))
        by_motion = by_motion.reshape(len(self.position), 3, self.model.n, 3)
        by_load = -np.matmul(
            by_motion[:, :, self.rest.axes[:, 0], self.rest.axes[:, 1]], self.rest.compliance
        )
        by_geometry = self._turned(self.kinematics.geometry_jacobian[:, :3])
        by_geometry[:, :, : 6 * self.model.n] += np.matmul(by_load, self.rest.coupling)
        owners = [*self.model.joint_names, "tool"]
        first = next(iter(self.model.points))
        for k, name in enumerate(names):
            owner, _, key = name.rpartition(".")
            if name == SOCKET_SCALE:
                result[:, :, k] = -np.where(self.poses.in_socket[:, None], self.poses.position, 0.0)
            elif owner.startswith("station.") and key in STATION:
                result[:, :, k] = self._by_station(owner.removeprefix("station."), key)
            elif owner.startswith("point."):
                own = self.poses.target == owner.removeprefix("point.")
                result[own, :, k] = by_geometry[own, :, 6 * self.model.n + 3 + "xyz".index(key)]
            elif key in GEOMETRY:
                result[:, :, k] = by_geometry[:, :, 6 * owners.index(owner) + GEOMETRY.index(key)]
                if owner == "tool" and key.startswith("length"):
                    result[self.poses.target != first, :, k] = 0.0
            elif key in ("backlash", "gravity_compliance") or key.startswith("transmission_"):
                i = self.model.joint_index(owner)
                result[:, :, k] = self._twist(i, key)[:, None] * by_geometry[:, :, 6 * i]
            elif key == "hardening":
                i = self.model.joint_index(owner.removesuffix(".drive"))
                result[:, :, k] = self._twist(i, key)[:, None] * by_motion[:, :, i, 2]
            elif key in LATERAL:
                i = self.model.joint_index(owner)
                tilt = self._lateral[:, i, LATERAL.index(key)]
                result[:, :, k] = np.matmul(by_motion[:, :, i, :2], tilt[:, :, None])[:, :, 0]
            else:
                result[:, :, k] = np.matmul(by_load, self.load(name)[:, :, None])[:, :, 0]
        return result

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
        return lateral_slopes(self.model, self.poses.q, masses)

    def _turned(self, columns: np.ndarray) -> np.ndarray:
        return np.matmul(self.base, columns)

    def _by_station(self, station: str, key: str) -> np.ndarray:
        own = (self.poses.station == station)[:, None]
        if key in ("x", "y", "z"):
            return own * np.eye(3)["xyz".index(key)]
        values = [self.model.value(f"station.{station}.{k}") for k in STATION]
        arm = self.position - np.array(values[:3]) + _socket_shift(self.model, self.poses)
        return own * np.cross(left_jacobian(np.array(values[3:]))[:, "xyz".index(key[1])], arm)

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


def _socket_shift(model: RobotModel, poses: PoseSet) -> np.ndarray:
    """Shift (N, 3), m, of the sockets from their declared positions in the fixture, by the scale of their distances."""
    return np.where(poses.in_socket[:, None], model.stations.scale[0] * poses.position, 0.0)


def left_jacobian(vector: np.ndarray) -> np.ndarray:
    """Left Jacobian (3, 3) of a rotation vector (3,): rotation in fixed axes per change of the vector."""
    angle = float(np.linalg.norm(vector))
    skew = skew_matrix(vector)
    if angle < 1e-8:
        return np.eye(3) + skew / 2
    return (
        np.eye(3) + (1 - np.cos(angle)) / angle**2 * skew + (angle - np.sin(angle)) / angle**3 * skew @ skew
    )


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
        model, poses.q, poses.payload, poses.target, flank=flank, elastic=elastic, jacobians=jacobians
    )
    at, base = np.empty((len(poses), 3)), np.empty((len(poses), 3, 3))
    for name in poses.stations:
        own, place = poses.station == name, model.stations.pose[model.station_index(name)]
        at[own], base[own] = place[:3], vector_rotation(place[3:])
    position = np.matmul(base, tool.kinematics.position[:, :, None])[:, :, 0] + at
    position -= _socket_shift(model, poses)
    return PredictedMeasurements(model, poses, position, base, tool.rest, tool.kinematics)


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
