"""Declarations of a study file, one frozen dataclass per kind of study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from flexcal.errors import FlexcalError

MOST_TASKS = 1_000_000
"""Largest number of tasks of a study."""


@dataclass(frozen=True)
class SeedsConfig:
    """Seeds `first`, `first` + 1, …: `count` of them for every combination of options."""

    count: int
    first: int = 1

    def __post_init__(self) -> None:
        if self.count < 1 or self.first < 0:
            raise FlexcalError(
                "E-STUDY-001", "seeds need a count of at least 1 and a first that is not negative."
            )


@dataclass(frozen=True)
class UniformConfig:
    """Uniformly distributed between two numbers."""

    uniform: tuple[float, float]

    def __post_init__(self) -> None:
        _require_order("uniform", self.uniform)


@dataclass(frozen=True)
class LogUniformConfig:
    """Logarithm uniformly distributed between those of two positive numbers."""

    log_uniform: tuple[float, float]

    def __post_init__(self) -> None:
        if not min(self.log_uniform) > 0:
            raise FlexcalError("E-STUDY-002", "log_uniform needs two positive numbers.")
        _require_order("log_uniform", self.log_uniform)


def _require_order(name: str, limits: tuple[float, float]) -> None:
    if limits[0] > limits[1]:
        raise FlexcalError(
            "E-STUDY-028", f"{name} needs its limits in order; write {name}: [{limits[1]:g}, {limits[0]:g}]."
        )


@dataclass(frozen=True)
class ChoiceConfig:
    """One of these values, each with the same probability."""

    choice: tuple[Any, ...]

    def __post_init__(self) -> None:
        if not self.choice:
            raise FlexcalError("E-STUDY-003", "choice needs at least one value.")


@dataclass(frozen=True)
class DrawConfig:
    """Random values of options: `count` combinations, drawn from `seed`. The first ones stay when the count grows."""

    count: int
    options: Mapping[str, UniformConfig | LogUniformConfig | ChoiceConfig]
    seed: int = 0

    def __post_init__(self) -> None:
        if self.count < 1 or self.seed < 0:
            raise FlexcalError(
                "E-STUDY-004", "a draw needs a count of at least 1 and a seed that is not negative."
            )


@dataclass(frozen=True)
class ResamplingConfig:
    """How a data set is resampled: one of the three.

    Parameters
    ----------
    bootstrap : int
        Number of data sets with the residuals of the fit drawn anew, with replacement, among those of the same station and kind
        (Efron and Tibshirani 1993, section 9.4).
    jackknife : int
        Number of random groups of poses, of which each is left out in turn.
    leave_one_out : str
        "pose", "station", or a column of the files: the measurements with each of its values are left out in turn.
    seed : int
        Seed of the bootstrap, and of the groups of the jackknife.
    """

    bootstrap: int = 0
    jackknife: int = 0
    leave_one_out: str = ""
    seed: int = 0

    def __post_init__(self) -> None:
        if min(self.bootstrap, self.jackknife, self.seed) < 0:
            raise FlexcalError("E-STUDY-005", "counts and seeds of the resampling must not be negative.")
        if (self.bootstrap > 0) + (self.jackknife > 0) + bool(self.leave_one_out) != 1:
            raise FlexcalError(
                "E-STUDY-006",
                "resampling needs one of bootstrap: COUNT, jackknife: GROUPS and leave_one_out: pose, station or COLUMN.",
            )
        if self.bootstrap > MOST_TASKS:
            raise FlexcalError(
                "E-STUDY-029", f"bootstrap: {self.bootstrap} is too many; write at most {MOST_TASKS}."
            )
        if self.jackknife == 1:
            raise FlexcalError("E-STUDY-007", "a jackknife needs at least 2 groups.")


@dataclass(frozen=True, kw_only=True)
class VariedConfig:
    """Tasks on a `robot`. `options` hold for all, `grid` lists values of which every combination runs, `draw` draws combinations at random.

    Names are those of the options of the kind, with dots for those of the cell.
    """

    robot: str
    options: dict[str, Any] = field(default_factory=dict)
    grid: dict[str, list[Any]] = field(default_factory=dict)
    draw: DrawConfig | None = None


@dataclass(frozen=True, kw_only=True)
class VirtualCalibrationConfig(VariedConfig):
    """Calibrations of virtual robots with known true parameters, which measured positions alone identify; options as of
    `VirtualCalibrationOptions`.
    """

    kind: Literal["virtual_calibration"]
    seeds: SeedsConfig


@dataclass(frozen=True, kw_only=True)
class TwoStageConfig(VariedConfig):
    """Two-stage calibrations of virtual robots, as of 'flexcal demo'; options as of `TwoStageOptions`."""

    kind: Literal["two_stage"]
    seeds: SeedsConfig


@dataclass(frozen=True, kw_only=True)
class CalibrateConfig(VariedConfig):
    """Calibrations on files of measured `poses`, resampled, or with other options; these as of `CalibrateOptions`."""

    kind: Literal["calibrate"]
    poses: tuple[str, ...]
    resampling: ResamplingConfig | None = None


StudyConfig = VirtualCalibrationConfig | TwoStageConfig | CalibrateConfig
