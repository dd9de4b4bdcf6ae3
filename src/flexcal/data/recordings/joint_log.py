"""One joint log on a uniform time base."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexcal.data.recordings.time_base import TimeBase
from flexcal.errors import FlexcalError


@dataclass(frozen=True)
class RecordingLabel:
    """Label of a recording within a plan: indices from 0 of pose, realisation and experiment, and the sign, ±1."""

    pose: int
    realisation: int
    experiment: int
    sign: int

    def __post_init__(self) -> None:
        if self.sign not in (-1, 1):
            raise FlexcalError("E-LOG-003", f"the sign of a recording is +1 or -1, not {self.sign}.")
        if min(self.pose, self.realisation, self.experiment) < 0:
            raise FlexcalError(
                "E-LOG-004", "pose, realisation and experiment of a recording are counted from 0."
            )

    @property
    def name(self) -> str:
        """As its file is called, without the ending; counted from 1: `pose_1_realisation_4_experiment_2_minus`."""
        counts = f"pose_{self.pose + 1}_realisation_{self.realisation + 1}_experiment_{self.experiment + 1}"
        return f"{counts}_{'plus' if self.sign > 0 else 'minus'}"


@dataclass(frozen=True, eq=False)
class Recording:
    """Joint log: N samples of n joints at t = start + k · time_step.

    Parameters
    ----------
    time_step : float
        Time between samples, s.
    q : ndarray
        Motor positions (N, n) referred to the joint, rad (m where prismatic).
    torque : ndarray
        Motor torques (N, n) referred to the joint, N m (N).
    arm : ndarray, optional
        Positions (N, n) on the arm side of elastic joints.
    start : float
        Time of the first sample, s.
    label : RecordingLabel, optional
        Place of the recording in a frequency experiment.
    tilt_x, tilt_y : ndarray, optional
        Tilts (N, n) of the bearings about x and y, rad, beside `arm`.
    velocity, acceleration, arm_velocity, external_torque : ndarray, optional
        Columns `dq`, `ddq`, `dqa` and `tau_ext` (N, n), where the log has them.
    force, moment : ndarray, optional
        Readings (N, 3) of the force sensor, N and N m.
    temperature : ndarray, optional
        Temperature (N,).
    payload : ndarray, optional
        Mass (N,), kg, the same throughout.
    time_base : TimeBase, optional
        How the time stamps of the file were.
    file : Path, optional
        File that the recording was read from.
    sensors : tuple of str
        Names of the S sensors on the arm that recorded too.
    sensed : ndarray, optional
        Their readings (N, S), m/s², m/s or m.

    Raises
    ------
    FlexcalError
        Where shapes do not fit or the time step is not positive.
    """

    time_step: float
    q: np.ndarray
    torque: np.ndarray
    arm: np.ndarray | None = None
    start: float = 0.0
    label: RecordingLabel | None = None
    tilt_x: np.ndarray | None = None
    tilt_y: np.ndarray | None = None
    velocity: np.ndarray | None = None
    acceleration: np.ndarray | None = None
    arm_velocity: np.ndarray | None = None
    external_torque: np.ndarray | None = None
    force: np.ndarray | None = None
    moment: np.ndarray | None = None
    temperature: np.ndarray | None = None
    payload: np.ndarray | None = None
    time_base: TimeBase | None = None
    file: Path | None = None
    sensors: tuple[str, ...] = ()
    sensed: np.ndarray | None = None

    def __post_init__(self) -> None:
        if not 0 < self.time_step < np.inf:
            raise FlexcalError(
                "E-LOG-005", f"the time step of a recording is {self.time_step} s; it must be positive."
            )
        if self.q.ndim != 2:
            raise FlexcalError(
                "E-LOG-006", f"q of a recording has shape {self.q.shape}; (samples, joints) is needed."
            )
        for name in (
            "torque",
            "arm",
            "tilt_x",
            "tilt_y",
            "velocity",
            "acceleration",
            "arm_velocity",
            "external_torque",
        ):
            values = getattr(self, name)
            if values is not None and values.shape != self.q.shape:
                raise FlexcalError(
                    "E-LOG-007", f"{name} of a recording has shape {values.shape}, but q has {self.q.shape}."
                )
        for name in ("force", "moment"):
            values = getattr(self, name)
            if values is not None and values.shape != (len(self), 3):
                raise FlexcalError(
                    "E-LOG-008", f"{name} of a recording has shape {values.shape}, not ({len(self)}, 3)."
                )
        if self.sensor_readings.shape != (len(self), len(self.sensors)):
            raise FlexcalError(
                "E-LOG-009",
                f"readings of {len(self.sensors)} sensors have shape {self.sensor_readings.shape}, but q has {self.q.shape}.",
            )
        for name in ("temperature", "payload"):
            values = getattr(self, name)
            if values is not None and values.shape != self.q.shape[:1]:
                raise FlexcalError(
                    "E-LOG-010", f"{name} of a recording has shape {values.shape}, not ({len(self)},)."
                )

    def __len__(self) -> int:
        return self.q.shape[0]

    @property
    def sensor_readings(self) -> np.ndarray:
        """`sensed`, (N, 0) without sensors."""
        return np.empty((len(self), 0)) if self.sensed is None else self.sensed

    @property
    def name(self) -> str:
        """The file it comes from, else the name of its label: what messages call it."""
        if self.file is not None:
            return str(self.file)
        return "a recording without a label" if self.label is None else self.label.name

    @property
    def time(self) -> np.ndarray:
        """Sample times (N,), s."""
        return self.start + self.time_step * np.arange(len(self))

    @property
    def duration(self) -> float:
        """From the first sample to the last, s."""
        return self.time_step * (len(self) - 1)
