"""Options of the tasks of a study, by kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

from flexcal.calibration.fit import LossName
from flexcal.errors import FlexcalError
from flexcal.files.structuring import structure
from flexcal.jobs.experiments import PlanName
from flexcal.jobs.two_stage import CellName
from flexcal.virtual_cell import CellConfig

O = TypeVar("O")  # noqa: E741
_FEWEST = 2


@dataclass(frozen=True)
class VirtualCalibrationOptions:
    """Options of a calibration of a virtual robot.

    Parameters
    ----------
    poses : int
        Number of measured poses.
    plan : {"random", "designed"}
        Poses at random, or the most informative ones as 'flexcal design poses' chooses them.
    terms : tuple of str
        Error terms as of 'flexcal calibrate --terms', [auto] for those that cross-validation selects; by default kinematic, and backlash
        where robot.yaml declares it.
    loss : str
        Loss function.
    elastic : bool
        Whether the fitted robot deflects, where robot.yaml declares springs.
    verification_poses : int
        Number of random poses at which the calibrated robot is compared with the true one.
    cell : CellConfig
        Settings of the cell; those that the study does not give are those of cell.yaml beside robot.yaml, if there is one.
    """

    poses: int = 40
    plan: Literal["random", "designed"] = "random"
    terms: tuple[str, ...] = ()
    loss: LossName = "squares"
    elastic: bool = True
    verification_poses: int = 100
    cell: CellConfig = field(default_factory=CellConfig)

    def __post_init__(self) -> None:
        if min(self.poses, self.verification_poses) < _FEWEST:
            raise FlexcalError("E-STUDY-008", f"poses and verification_poses must be at least {_FEWEST}.")


@dataclass(frozen=True)
class TwoStageOptions:
    """Options of a two-stage calibration: the `plan` and the cell (`cell_kind`) of 'flexcal demo', and settings of a virtual `cell`.

    `inertias_known` gives the identification the true link inertias.
    """

    plan: PlanName = "default"
    cell_kind: CellName = "virtual"
    inertias_known: bool = False
    cell: CellConfig = field(default_factory=CellConfig)


@dataclass(frozen=True)
class CalibrateOptions:
    """Options of 'flexcal calibrate'; without `terms`, those of robot.yaml."""

    terms: tuple[str, ...] = ()
    loss: LossName = "auto"
    secant_scale: float = 0.0
    elasticity: Literal["reestimated", "marginalised"] = "reestimated"

    def __post_init__(self) -> None:
        if not self.secant_scale >= 0:
            raise FlexcalError("E-STUDY-009", "secant_scale must not be negative.")


def structured(values: Mapping[str, Any], cls: type[O], cell: Mapping[str, Any]) -> O:
    """Options of a class from their values by name, with dots between the names of a mapping and of what is in it.

    `cell` holds the settings that the values change. Raises `StructureError`.
    """
    nested: dict[str, Any] = {"cell": _copy(cell)} if cell else {}
    for name, value in values.items():
        *path, last = name.split(".")
        inside = nested
        for key in path:
            following = inside.setdefault(key, {})
            if not isinstance(following, dict):
                raise FlexcalError(
                    "E-STUDY-010", f"'{name}' and '{key}' cannot both be given; leave one of them out."
                )
            inside = following
        inside[last] = value
    return structure(nested, cls)


def _copy(data: Any) -> Any:
    return {key: _copy(value) for key, value in data.items()} if isinstance(data, Mapping) else data
