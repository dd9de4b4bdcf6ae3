"""Plan of exciting trajectories."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexcal.data.plans.periodic_paths import FourierPaths, SplinePaths
from flexcal.data.plans.periodic_schedule import check_schedule
from flexcal.errors import FlexcalError


@dataclass(frozen=True, eq=False)
class TrajectoryPlan:
    """E periodic trajectories of an n-joint robot.

    Parameters
    ----------
    name : str
        Name of the plan.
    paths : FourierPaths or SplinePaths
        What the joints follow over one period, again and again.
    base_frequency_hz : float
        Base frequency, Hz.
    periods, settle_periods : int
        Recorded periods of each trajectory, and how many of them are dropped at the start.
    rate_hz : float
        Rate of the position controller and of the log, Hz.
    torque : {"held", "instantaneous", "mean"}
        What the logged torque is over a sample; `tau` in files.
    seed : int
        Seed of the design.
    kind : {"trajectory"}
        Kind of the plan, in files.
    payload : float, optional
        Mass, kg, at the declared payload's centre of mass; by default as declared in robot.yaml.
    kp, kd : ndarray, optional
        Gains (n,) of the position controller referred to the joint, N m/rad and N m s/rad; None where robot.yaml declares none.

    Raises
    ------
    FlexcalError
        Where shapes or values do not fit together.
    """

    kind: Literal["trajectory"] = field(default="trajectory", kw_only=True)
    name: str
    paths: FourierPaths | SplinePaths
    payload: float | None = field(default=None, kw_only=True)
    base_frequency_hz: float
    periods: int
    settle_periods: int
    kp: NDArray[np.float64] | None = field(default=None, kw_only=True)
    kd: NDArray[np.float64] | None = field(default=None, kw_only=True)
    rate_hz: float
    torque: Literal["held", "instantaneous", "mean"] = field(metadata={"key": "tau"})
    seed: int

    def __post_init__(self) -> None:
        self._check_gains()
        self._check_values()

    def __len__(self) -> int:
        """Number of trajectories."""
        return len(self.paths.coefficients)

    @property
    def joint_count(self) -> int:
        """Joints of the robot that the plan is for."""
        return self.paths.coefficients.shape[2]

    @property
    def samples_per_period(self) -> int:
        """Controller ticks a period."""
        return round(self.rate_hz / self.base_frequency_hz)

    @property
    def duration(self) -> float:
        """Length of one recording, s."""
        return self.periods / self.base_frequency_hz

    def motion(self, number: int, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Motion of one trajectory.

        Parameters
        ----------
        number : int
            Index of the trajectory.
        time : ndarray
            Times (N,), s.

        Returns
        -------
        position, velocity, acceleration : ndarray
            Each (N, n), rad and s.
        """
        basis = self.paths.basis(time, 1 / self.base_frequency_hz)
        position, velocity, acceleration = basis @ self.paths.coefficients[number]
        return position, velocity, acceleration

    def _check_gains(self) -> None:
        if (self.kp is None) != (self.kd is None):
            raise FlexcalError("E-PLAN-032", "the plan has one of kp and kd; give both or neither.")
        for name in ("kp", "kd"):
            gains = getattr(self, name)
            if gains is None:
                continue
            gains = np.asarray(gains, dtype=np.float64)
            object.__setattr__(self, name, gains)
            if gains.shape != (self.joint_count,):
                raise FlexcalError(
                    "E-PLAN-033",
                    f"{name} has {gains.size} gains, but there are {self.joint_count} joints; give one each.",
                )

    def _check_values(self) -> None:
        check_schedule(self)
        ticks = self.rate_hz / self.base_frequency_hz
        if abs(ticks - round(ticks)) > 1e-9 * ticks:
            raise FlexcalError(
                "E-PLAN-034",
                f"a period of {1 / self.base_frequency_hz:g} s is no whole number of samples at {self.rate_hz:g} Hz; "
                "change base_frequency_hz.",
            )
