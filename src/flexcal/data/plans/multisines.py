"""Plan of frequency experiments."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexcal.data.plans.periodic_schedule import check_schedule
from flexcal.errors import FlexcalError


@dataclass(frozen=True, eq=False)
class MultisinePlan:
    """Orthogonal multisine experiments in P poses of an n-joint robot, n_u of its axes excited on L lines.

    Parameters
    ----------
    name : str
        Name of the plan.
    poses : ndarray
        Commanded joint positions (P, n), rad.
    joints : tuple of int
        Indices of the excited axes (in files: numbers from 1, as in the columns q1…qn).
    base_frequency_hz : float
        Base frequency, Hz.
    lines : ndarray
        Excited multiples (L,) of `base_frequency_hz`.
    amplitude : ndarray
        Cosine amplitudes (n_u, L), N m.
    periods, settle_periods : int
        Recorded periods per experiment, and how many of them are dropped at the start.
    realisations : int
        Independent draws of the phases; each takes n_u experiments, twice that with `signs`.
    signs : bool
        Whether each experiment is repeated with the excitation reversed under the same reference motion.
    reference_amplitude, reference_frequency_hz : float
        Slow motion under the excitation, rad and Hz.
    kp, kd : ndarray
        Gains (n,) of the position controller referred to the joint, N m/rad and N m s/rad.
    rate_hz : float
        Rate of the controller, Hz.
    torque : {"held", "instantaneous", "mean"}
        What the logged torque is over a sample; `tau` in files.
    seed : int
        Seed of the random phases.
    kind : {"multisine"}
        Kind of the plan, in files.
    payload : float, optional
        Mass, kg, at the declared payload's centre of mass; by default as declared in robot.yaml.
    detection_lines : ndarray
        Left-out multiples (K,) of `base_frequency_hz`.
    crest : {"random", "optimised"}
        Random phases, or ones that are shifted from there for small peaks.

    Raises
    ------
    FlexcalError
        Where shapes or values do not fit together.
    """

    kind: Literal["multisine"] = field(default="multisine", kw_only=True)
    name: str
    poses: NDArray[np.float64]
    joints: tuple[int, ...] = field(metadata={"joints": True})
    payload: float | None = field(default=None, kw_only=True)
    base_frequency_hz: float
    lines: NDArray[np.int64]
    detection_lines: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64), kw_only=True)
    amplitude: NDArray[np.float64]
    periods: int
    settle_periods: int
    realisations: int
    signs: bool
    reference_amplitude: float
    reference_frequency_hz: float
    kp: NDArray[np.float64]
    kd: NDArray[np.float64]
    rate_hz: float
    torque: Literal["held", "instantaneous", "mean"] = field(metadata={"key": "tau"})
    crest: Literal["random", "optimised"] = field(default="random", kw_only=True)
    seed: int

    def __post_init__(self) -> None:
        for name in ("poses", "amplitude", "kp", "kd"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        for name in ("lines", "detection_lines"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.int64))
        object.__setattr__(self, "joints", tuple(int(joint) for joint in self.joints))
        self._check_shapes()
        self._check_values()

    @property
    def joint_count(self) -> int:
        """Number of joints of the robot."""
        return self.poses.shape[1]

    @property
    def experiments(self) -> int:
        """Number of orthogonal experiments of one realisation: as many as excited axes."""
        return len(self.joints)

    @property
    def recordings_per_pose(self) -> int:
        """Number of logs of one pose."""
        return self.realisations * self.experiments * (2 if self.signs else 1)

    @property
    def frequencies_hz(self) -> np.ndarray:
        """The excited frequencies (L,), Hz."""
        return self.lines * self.base_frequency_hz

    @property
    def duration(self) -> float:
        """Length of one recording, s."""
        return self.periods / self.base_frequency_hz

    def _check_shapes(self) -> None:
        if self.poses.ndim != 2 or 0 in self.poses.shape:
            raise FlexcalError(
                "E-PLAN-001", "poses must be a list of poses, each a list with one angle per joint (rad)."
            )
        n = self.poses.shape[1]
        if not self.joints or len(set(self.joints)) != len(self.joints):
            raise FlexcalError(
                "E-PLAN-002", "joints must name at least one excited axis, and each only once."
            )
        wrong = [joint for joint in self.joints if not 0 <= joint < n]
        if wrong:
            raise FlexcalError(
                "E-PLAN-003", f"joints names axis {wrong[0] + 1}, but the poses have {n} joints."
            )
        for name, gains in (("kp", self.kp), ("kd", self.kd)):
            if gains.shape != (n,):
                raise FlexcalError(
                    "E-PLAN-004",
                    f"{name} has {gains.size} gains, but the poses have {n} joints; give one each.",
                )
        if self.lines.ndim != 1 or self.detection_lines.ndim != 1 or not self.lines.size:
            raise FlexcalError(
                "E-PLAN-005", "lines must be a list with at least one multiple of the base frequency."
            )
        shape = (len(self.joints), self.lines.size)
        if self.amplitude.shape != shape:
            raise FlexcalError(
                "E-PLAN-006",
                f"amplitude has the shape {self.amplitude.shape}, but {shape[0]} axes and {shape[1]} lines need {shape}.",
            )

    def _check_values(self) -> None:
        lines = np.concatenate([self.lines, self.detection_lines])
        if lines.min() < 1 or np.unique(lines).size != lines.size or np.any(np.diff(self.lines) < 0):
            raise FlexcalError(
                "E-PLAN-007",
                "lines must be ascending multiples of the base frequency from 1, and none a detection line too.",
            )
        check_schedule(self)
        if 2 * lines.max() * self.base_frequency_hz >= self.rate_hz:
            raise FlexcalError(
                "E-PLAN-008",
                f"the line {lines.max()} lies at {lines.max() * self.base_frequency_hz:g} Hz, not below half the rate of "
                f"{self.rate_hz:g} Hz; lower the band or raise rate_hz.",
            )
        if self.realisations < 1:
            raise FlexcalError("E-PLAN-009", f"realisations is {self.realisations}; at least one is needed.")
        if self.reference_amplitude < 0 or self.reference_frequency_hz < 0:
            raise FlexcalError(
                "E-PLAN-010", "reference_amplitude and reference_frequency_hz must not be negative."
            )
        for name in ("reference_amplitude", "reference_frequency_hz"):
            if 0 < getattr(self, name) < 1e-9:
                raise FlexcalError(
                    "E-PLAN-011", f"{name} is {getattr(self, name):g}, too little to move; write 0 for none."
                )
