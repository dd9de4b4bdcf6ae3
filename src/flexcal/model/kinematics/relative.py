"""Motion of a point as an instrument on the robot sees it."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics.forward import PointKinematics
from flexcal.model.robot import RobotModel


def carrier_kinematics(
    model: RobotModel, q: np.ndarray, deflection: np.ndarray, stations: np.ndarray, *, jacobians: bool
) -> PointKinematics | None:
    """Kinematics of where the robot carries the `stations` (N,) at `q` (N, n), bent by `deflection` (N, n, 3); None where it carries none.

    Instruments that stand still are at the base. Without `jacobians` these are empty. Raises `FlexcalError` for a robot with joints that
    follow others.
    """
    names = [name for name in dict.fromkeys(stations.tolist()) if name in model.carriers]
    if not names:
        return None
    model.require_motors("the joints that carry an instrument")
    count, n = len(q), model.n
    rows = count if jacobians else 0
    position, orientation = np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
    geometry, motion = np.zeros((rows, 6, 6 * n + 6)), np.zeros((rows, 6, n, 3))
    for name in names:
        own, frame = np.flatnonzero(stations == name), model.carriers[name]
        position[own], orientation[own], by_geometry, by_motion = model.tree.point(
            frame.joint,
            np.ascontiguousarray(frame.rotation),
            np.ascontiguousarray(frame.translation),
            np.ascontiguousarray(frame.xyz),
            np.ascontiguousarray(model.geometry.errors),
            np.zeros(6),
            np.ascontiguousarray(q[own]),
            np.ascontiguousarray(deflection[own]),
            jacobians,
        )
        if jacobians:
            geometry[own, :, : 6 * n] = by_geometry[:, :, : 6 * n]
            motion[own] = by_motion.reshape(len(own), 6, n, 3)
    return PointKinematics(position, orientation, geometry, motion)


def relative_motion(
    point: PointKinematics, carrier: PointKinematics, by_point: np.ndarray, by_carrier: np.ndarray
) -> np.ndarray:
    """Motions (N, 6, k) of a point seen from its carrier, in the carrier's axes, from those of both in the base frame (N, 6, k).

    The rotation of the carrier moves the point the other way.
    """
    arm = point.position - carrier.position
    swept = np.cross(by_carrier[:, 3:], arm[:, :, None], axis=1)
    back = np.swapaxes(carrier.orientation, 1, 2)
    moved = np.matmul(back, by_point[:, :3] - by_carrier[:, :3] - swept)
    return np.concatenate([moved, np.matmul(back, by_point[:, 3:] - by_carrier[:, 3:])], axis=1)


def relative_kinematics(point: PointKinematics, carrier: PointKinematics) -> PointKinematics:
    """Kinematics of points in the frames of their carriers in place of the base frame."""
    back = np.swapaxes(carrier.orientation, 1, 2)
    arm = point.position - carrier.position
    motion = point.motion_jacobian
    shape = (len(motion), 6, -1)
    relative = (
        relative_motion(point, carrier, own.reshape(shape), other.reshape(shape)).reshape(own.shape)
        if len(own)
        else own
        for own, other in (
            (point.geometry_jacobian, carrier.geometry_jacobian),
            (motion, carrier.motion_jacobian),
        )
    )
    return PointKinematics(
        np.matmul(back, arm[:, :, None])[:, :, 0], np.matmul(back, point.orientation), *relative
    )
