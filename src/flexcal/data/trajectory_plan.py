"""What to command to excite the whole dynamics of a robot."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexcal.errors import FlexcalError


@dataclass(frozen=True, eq=False)
class TrajectoryPlan:
    """E periodic trajectories of an n-joint robot, each a finite Fourier series of H harmonics in every joint (Swevers 1997).

    centre: (E, n) positions about which the joints move, rad.
    sine, cosine: (E, n, H) amplitudes of the velocity's sines and cosines at the multiples 1…H of `base_frequency_hz`, rad/s.
    payload: kg at the declared payload's centre of mass; None takes what robot.yaml declares.
    periods, settle_periods: recorded periods of each trajectory, and how many of them are dropped at the start.
    kp, kd: (n,) gains of the position controller referred to the joint, N m/rad and N m s/rad; rate_hz its rate.
    torque: what the logged torque is over a sample; `tau` in files.
    seed: of the design.

    Raises `FlexcalError` where shapes or values do not fit together.
    """

    kind: Literal["trajectory"] = field(default="trajectory", kw_only=True)
    name: str
    centre: NDArray[np.float64]
    sine: NDArray[np.float64]
    cosine: NDArray[np.float64]
    payload: float | None = field(default=None, kw_only=True)
    base_frequency_hz: float
    periods: int
    settle_periods: int
    kp: NDArray[np.float64]
    kd: NDArray[np.float64]
    rate_hz: float
    torque: Literal["held", "instantaneous", "mean"] = field(metadata={"key": "tau"})
    seed: int

    def __post_init__(self) -> None:
        for name in ("centre", "sine", "cosine", "kp", "kd"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        self._check_shapes()
        self._check_values()

    def __len__(self) -> int:
        """Number of trajectories."""
        return len(self.centre)

    @property
    def joint_count(self) -> int:
        """Joints of the robot that the plan is for."""
        return self.centre.shape[1]

    @property
    def samples_per_period(self) -> int:
        """Controller ticks a period."""
        return round(self.rate_hz / self.base_frequency_hz)

    @property
    def duration(self) -> float:
        """Length of one recording, s."""
        return self.periods / self.base_frequency_hz

    def motion(self, number: int, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and acceleration (N, n) of trajectory `number` at times (N,), in rad and s."""
        sine, cosine = self.sine[number].T, self.cosine[number].T
        omega = 2 * np.pi * self.base_frequency_hz * np.arange(1, len(sine) + 1)[:, None]
        s, c = np.sin(time[:, None] * omega.T), np.cos(time[:, None] * omega.T)
        position = self.centre[number] + s @ (cosine / omega) - c @ (sine / omega)
        return position, c @ cosine + s @ sine, c @ (omega * sine) - s @ (omega * cosine)

    def _check_shapes(self) -> None:
        if self.centre.ndim != 2 or 0 in self.centre.shape:
            raise FlexcalError("centre must be a list of trajectories, each a list with one angle per joint.")
        for name in ("sine", "cosine"):
            shape = getattr(self, name).shape
            if len(shape) != 3 or shape[:2] != self.centre.shape or not shape[2]:
                raise FlexcalError(
                    f"{name} has shape {shape}; {self.centre.shape[0]} trajectories of {self.centre.shape[1]} joints need "
                    f"({self.centre.shape[0]}, {self.centre.shape[1]}, harmonics)."
                )
        if self.sine.shape != self.cosine.shape:
            raise FlexcalError("sine and cosine must have the same number of harmonics.")
        for name, gains in (("kp", self.kp), ("kd", self.kd)):
            if gains.shape != self.centre.shape[1:]:
                raise FlexcalError(
                    f"{name} has {gains.size} gains, but there are {self.centre.shape[1]} joints; give one each."
                )

    def _check_values(self) -> None:
        if not (self.base_frequency_hz > 0 and self.rate_hz > 0):
            raise FlexcalError("base_frequency_hz and rate_hz must be positive.")
        ticks = self.rate_hz / self.base_frequency_hz
        if abs(ticks - round(ticks)) > 1e-9 * ticks:
            raise FlexcalError(
                f"a period of {1 / self.base_frequency_hz:g} s is no whole number of samples at {self.rate_hz:g} Hz; "
                "change base_frequency_hz."
            )
        if not 0 <= self.settle_periods < self.periods:
            raise FlexcalError(
                f"settle_periods is {self.settle_periods} of {self.periods} periods; keep at least one."
            )
        if self.payload is not None and self.payload < 0:
            raise FlexcalError(f"the payload is {self.payload:g} kg; it must not be negative.")
        if self.seed < 0:
            raise FlexcalError(f"the seed is {self.seed}; it must not be negative.")
