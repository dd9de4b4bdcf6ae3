"""Constant offset of a force and torque sensor, as columns of the joint torques."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flexcal.dynamics.inverse_model.drive_terms import Column, Memory
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel
from flexcal.model.torques import sensor_jacobian

WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True)
class SensorOffset:
    """Sensor offset `force_sensor.fx_offset`…: readings of each component of the declared force sensor without load.

    Sensors are rarely tared without a load. An offset along the axis of the last joint equals a torque offset, which absorbs it.
    """

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        torque = sensor_jacobian(model, motion.q)
        for number, name in enumerate(WRENCH):
            for joint in range(model.n):
                yield Column(f"force_sensor.{name}_offset", joint, torque[:, joint, number])
