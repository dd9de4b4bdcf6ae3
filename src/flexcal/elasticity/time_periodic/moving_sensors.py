"""Readings of sensors on an arm in slow reference motion, whose output matrices change along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.model.robot import ArmSensor
from flexcal.model.vibration import ElasticArm, sensor_frame

HARMONICS = 2
"""Highest harmonic of the motion of a sensor: the next is smaller by a factor of the amplitude (rad)."""


@dataclass(frozen=True, eq=False)
class MovingSensor:
    """Fourier coefficients of a sensor's output over one cycle of the reference motion, from order -`HARMONICS`.

    `columns` (orders, d, 3) are the displacements of the sensor's point by the elastic coordinates, `direction` (orders, 3) is that in
    which it measures, `tilt` (orders, d) what it reads by turning: of an accelerometer, the acceleration of its point less gravity times
    how its direction turns. `order` is the time derivative that it measures.
    """

    order: int
    columns: np.ndarray
    direction: np.ndarray
    tilt: np.ndarray

    @classmethod
    def of(
        cls, arm: ElasticArm, sensor: ArmSensor, configurations: list[np.ndarray], frequency_hz: float
    ) -> MovingSensor:
        """Sensor for configurations (nq,) at equally spaced instants of a cycle of the motion of `frequency_hz`."""
        frames = [sensor_frame(arm, at, sensor) for at in configurations]
        point, direction, columns, turned = (np.array(part) for part in zip(*frames, strict=True))
        tilt = np.zeros(turned.shape[:2])
        if sensor.feels_gravity:
            omega = 2j * np.pi * frequency_hz * np.arange(-HARMONICS, HARMONICS + 1)
            angles = 2 * np.pi * np.arange(len(point)) / len(point)
            waves = np.exp(1j * np.outer(angles, np.arange(-HARMONICS, HARMONICS + 1)))
            acceleration = np.real(waves @ (omega[:, None] ** 2 * harmonics(point, HARMONICS)))
            tilt = np.einsum("pdx,px->pd", turned, acceleration - arm.robot.gravity)
        return cls(
            sensor.order,
            harmonics(columns, HARMONICS),
            harmonics(direction, HARMONICS),
            harmonics(tilt, HARMONICS),
        )

    def reading(self, moved: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Reading (L, E) at the line due to elastic coordinates displaced by `moved` (L, bands, d, E) at the sidebands `s` (L, bands)."""
        bands = s.shape[1]
        middle = bands // 2
        near = np.arange(max(0, middle - HARMONICS), min(bands, middle + HARMONICS + 1))
        read = np.einsum("kd,lkdj->lj", self.tilt[HARMONICS + middle - near], moved[:, near])
        for band in near:
            seen = self.direction[HARMONICS + middle - band]
            if not seen.any():
                continue
            others = np.arange(max(0, band - HARMONICS), min(bands, band + HARMONICS + 1))
            displaced = np.einsum("kdx,lkdj->lxj", self.columns[HARMONICS + band - others], moved[:, others])
            read += s[:, band, None] ** self.order * np.einsum("x,lxj->lj", seen, displaced)
        return read


def harmonics(sampled: np.ndarray, highest: int) -> np.ndarray:
    """Fourier coefficients (2 highest + 1, ...) over one cycle of samples `sampled` (phases, ...), from order -highest."""
    angles = 2 * np.pi * np.arange(len(sampled)) / len(sampled)
    turn = np.exp(-1j * np.outer(np.arange(-highest, highest + 1), angles)) / len(sampled)
    return np.tensordot(turn, sampled, axes=1)
