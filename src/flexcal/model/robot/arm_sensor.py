"""Sensors on the arm side of the springs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.model.robot.measuring_config import ArmSensorConfig


@dataclass(frozen=True, eq=False)
class ArmSensor:
    """Arm-side sensor of the motion of one point of a link in one direction: an accelerometer on the link or a fixed vibrometer.

    `xyz` (3,) m is the point in the frame of the link that moves with joint number `joint`. `direction` (3,), of unit length, is in the
    link's frame where the sensor `moves` with the link, else in the robot's base frame. `order` is the time derivative that is measured: 0
    for a displacement, 1 for a velocity, 2 for an acceleration. An accelerometer measures n · (p̈ − g), so that its tilt counts.
    """

    name: str
    joint: int
    xyz: np.ndarray
    direction: np.ndarray
    moves: bool
    order: int
    config: ArmSensorConfig

    @property
    def unit(self) -> str:
        """SI unit of its readings."""
        return ("m", "m/s", "m/s²")[self.order]

    @property
    def feels_gravity(self) -> bool:
        """Whether tilt changes the reading, as for an accelerometer that turns with the link."""
        return self.moves and self.order == 2

    @property
    def mounting_std(self) -> np.ndarray:
        """Standard deviations (5,) of the mounting errors, in the order of `mounting_names`."""
        return np.repeat([self.config.position_std, self.config.direction_std], [3, 2])

    def misplaced(self, errors: np.ndarray) -> ArmSensor:
        """Sensor with mounting `errors` (5,): three of its position in m, two of its direction in rad."""
        first = np.cross(self.direction, np.eye(3)[np.argmin(np.abs(self.direction))])
        first /= np.linalg.norm(first)
        turned = self.direction + errors[3] * first + errors[4] * np.cross(self.direction, first)
        return replace(self, xyz=self.xyz + errors[:3], direction=turned / np.linalg.norm(turned))

    @property
    def column(self) -> str:
        """Name of the column of its readings in a log."""
        return sensor_column(self.name)


def sensor_column(name: str) -> str:
    """Name of the log column with the readings of the named sensor."""
    return f"sensor_{name}"


def sensitivity_name(sensor: str) -> str:
    """Parameter name of the sensitivity of an arm-side sensor."""
    return f"sensor.{sensor}.sensitivity"


def sensor_delay_name(sensor: str) -> str:
    """Parameter name of the delay of an arm-side sensor."""
    return f"sensor.{sensor}.delay"


def mounting_names(sensor: str) -> tuple[str, ...]:
    """Parameter names of the five mounting errors of an arm-side sensor, in the order that `ArmSensor.misplaced` takes."""
    keys = ("position_x", "position_y", "position_z", "direction_1", "direction_2")
    return tuple(f"sensor.{sensor}.{key}" for key in keys)
