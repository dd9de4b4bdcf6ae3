"""Readings of arm-side sensors as outputs of the linearised elastic robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.model.robot import ArmSensor
from flexcal.model.vibration.elastic_arm import ElasticArm


@dataclass(frozen=True, eq=False)
class SensorOutputs:
    """Readings y = (s^order motion + tilt) x of S sensors, by the displacements x of rotors and elastic coordinates.

    `motion`, `tilt` (S, E + d); `order` (S,). `derivatives` maps a parameter name to (∂motion, ∂tilt), which come from the motion of the
    rest position alone.
    """

    motion: np.ndarray
    tilt: np.ndarray
    order: np.ndarray
    derivatives: Mapping[str, tuple[np.ndarray, np.ndarray]]

    def __len__(self) -> int:
        return len(self.order)

    def at(self, s: np.ndarray) -> np.ndarray:
        """Output matrix o (L, S, E + d) with y = o x at the Laplace variables `s` (L,)."""
        return s[:, None, None] ** self.order[:, None] * self.motion + self.tilt

    def changes(self, s: np.ndarray, names: Sequence[str]) -> np.ndarray:
        """Derivatives ∂o (L, S, E + d, p) by the named parameters."""
        motion, tilt = (np.stack([self.derivatives[name][k] for name in names], axis=-1) for k in (0, 1))
        return s[:, None, None, None] ** self.order[:, None, None] * motion + tilt


def assemble_sensor_outputs(
    arm: ElasticArm,
    at: np.ndarray,
    sensors: Sequence[ArmSensor],
    rotors: int,
    motions: Mapping[str, np.ndarray],
) -> SensorOutputs:
    """Output rows of `sensors` for an arm in the configuration `at`, with `rotors` coordinates in front.

    `motions` (d,) by name say how the elastic coordinates of the rest position move with a parameter. With the axes a of revolute elastic
    coordinates that carry the point p, from the base outwards, the columns of the displacement are n · (a × (p − o)), those of the tilt
    −g · (a × n), their derivatives by another coordinate those of the rotation about its axis.
    """
    d = len(arm.elastic)
    motion, tilt = np.zeros((len(sensors), rotors + d)), np.zeros((len(sensors), rotors + d))
    moved = {name: (np.zeros_like(motion), np.zeros_like(tilt)) for name in motions}
    for row, sensor in enumerate(sensors):
        _, direction, columns, turned = sensor_frame(arm, at, sensor)
        _, axes, carries = arm.elastic_axes_at(sensor.joint)
        motion[row, rotors:] = columns @ direction
        # ∂(a_k × (p − o_k))/∂q_l = a_min × column_max: the nearer of both to the base turns the other's column
        order = arm.nearer()
        both = carries[:, None] & carries[None, :]
        near = np.where(order[..., None], axes[:, None], axes[None, :])  # of k and l
        far = np.where(order[..., None], columns[None, :], columns[:, None])
        by = np.cross(near, far) @ direction
        if sensor.moves:
            by += columns @ turned.T
        by = np.where(both, by, 0.0)
        by_tilt = None
        if sensor.feels_gravity:
            tilt[row, rotors:] = -turned @ arm.robot.gravity
            far = np.where(order[..., None], turned[None, :], turned[:, None])
            by_tilt = np.where(both, -np.cross(near, far) @ arm.robot.gravity, 0.0)
        for name, shift in motions.items():
            moved[name][0][row, rotors:] = by @ shift
            if by_tilt is not None:
                moved[name][1][row, rotors:] = by_tilt @ shift
    return SensorOutputs(motion, tilt, np.array([s.order for s in sensors], dtype=int), moved)


def sensor_frame(
    arm: ElasticArm, at: np.ndarray, sensor: ArmSensor
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Point (3,) m and direction (3,) of a sensor in the base frame, and their derivatives (d, 3) by the elastic coordinates; the
    direction of a sensor that moves with the link turns with every coordinate that carries it.
    """
    point, turn = arm.place(at, sensor.joint, sensor.xyz)
    origins, axes, carries = arm.elastic_axes_at(sensor.joint)
    columns = np.cross(axes, point - origins) * carries[:, None]
    direction = turn @ sensor.direction if sensor.moves else sensor.direction
    turned = np.cross(axes, direction) * carries[:, None] if sensor.moves else np.zeros_like(columns)
    return point, direction, columns, turned
