"""Identified link inertials of a robot, and the content of their results.json."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from flexcal.dynamics.inertials import TrajectoryTorques, relative_torque_error
from flexcal.files.formats import Block
from flexcal.jobs.pages import Identification, estimate_row
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header, quantities
from flexcal.model.robot import RobotModel
from flexcal.report.checks import Trust
from flexcal.report.pages import inertials_checks


@dataclass(frozen=True, eq=False, repr=False)
class InertialsIdentification(Identification):
    """Result of `identify_inertials`: link inertials, rotors and friction, and the torques before and after.

    Attributes
    ----------
    model : RobotModel
        The robot with the estimate.
    estimate : Estimate
        Masses, centres of mass, rotor inertias and friction.
    nominal : RobotModel
        The robot that the fit started from.
    before, after : tuple of TrajectoryTorques
        Torques of every trajectory with those that `nominal` and `model` predict.
    estimates : Path, optional
        The file that the estimate was stored in.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    block: ClassVar[Block] = "dynamics"
    nominal: RobotModel
    before: tuple[TrajectoryTorques, ...]
    after: tuple[TrajectoryTorques, ...]
    estimates: Path | None = None
    record: RunRecord = NOT_RECORDED

    @property
    def residuals(self) -> tuple[np.ndarray, ...]:
        """Measured minus predicted torques of every trajectory: Fourier coefficients (2 K + 1, n) of its mean period up to 5 Hz, N m."""
        return tuple(trajectory.residual for trajectory in self.after)

    @cached_property
    def nominal_error(self) -> float:
        """Relative torque error of the nominal robot, as a fraction."""
        return relative_torque_error(self.before)

    @cached_property
    def error(self) -> float:
        """Relative torque error of the fit, as a fraction."""
        return relative_torque_error(self.after)

    @property
    def headline(self) -> str:
        """Number of trajectories, and the relative torque errors."""
        count = len(self.after)
        return (
            f"{len(self.estimate.parameters)} parameters from {count} {'trajectory' if count == 1 else 'trajectories'}, relative torque "
            f"error {100 * self.error:.2f} %, before {100 * self.nominal_error:.2f} %"
        )

    def summary(self) -> str:
        """Every parameter with its standard deviation, and the verdict."""
        rows = [estimate_row(self.estimate, item.name) for item in self.estimate.parameters]
        return "\n".join([self.headline, *rows, self.trust.sentence])

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(inertials_checks(self._numbers, self.estimate))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {**header("inertials"), **self._numbers, "verdict": self.trust.document()}

    def write_arrays(self, folder: Path) -> None:
        """Write no arrays: the page shows results and estimate alone."""

    @property
    def _numbers(self) -> dict[str, Any]:
        return {
            "robot": self.nominal.name,
            "trajectories": len(self.after),
            "error_percent": {"nominal": 100 * self.nominal_error, "train": 100 * self.error},
            "parameters": quantities(self.estimate),
            "estimates": self.estimates,
            "command": self.record.command,
        }
