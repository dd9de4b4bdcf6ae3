"""Identified stiffness and damping of a robot, and the content of their results.json."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from flexcal.elasticity.identification import SpringFit
from flexcal.files.formats import Block
from flexcal.jobs.fleet_prior import PooledUse
from flexcal.jobs.pages import Identification, estimate_row
from flexcal.jobs.result_files import (
    NOT_RECORDED,
    RunRecord,
    dropped_parameters,
    header,
    quantities,
    springs_block,
    write_fitted_responses,
)
from flexcal.jobs.stiffness.bearing_axes import response_bearings_block
from flexcal.report.checks import Trust, misfit_document
from flexcal.report.pages import stiffness_checks
from flexcal.report.results import FittedResponse


@dataclass(frozen=True, eq=False, repr=False)
class StiffnessIdentification(Identification):
    """Result of `identify_stiffness`: stiffness and damping of drives and bearings, with the responses they were fitted to.

    Attributes
    ----------
    model : RobotModel
        The robot with the estimate, and with the bearing axes that it belongs to.
    estimate : Estimate
        Stiffness (N m/rad) and damping (N m s/rad) as `<joint>.drive.stiffness` and the like, masses, centres of mass, rotor
        inertias, friction and delays.
    fit : SpringFit
        What the fit left: complex errors, misfit by element, bearing axes.
    responses : tuple of FittedResponse
        Measured and fitted response of every pose.
    reference_known : bool
        Whether the plan told the reference motion.
    missing_poses : tuple of int
        Numbers, from 1, of the plan's poses without a response.
    further_joints : tuple of str
        Joints that robot.yaml declares rigid and that got a drive spring.
    remarks : tuple of str
        One sentence each, the most important last.
    pooled : PooledUse, optional
        What it had from other robots of the model.
    estimates : Path, optional
        The file that the estimate was stored in.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    block: ClassVar[Block] = "stiffness"
    fit: SpringFit
    responses: tuple[FittedResponse, ...]
    reference_known: bool
    missing_poses: tuple[int, ...]
    further_joints: tuple[str, ...]
    remarks: tuple[str, ...]
    pooled: PooledUse | None = None
    estimates: Path | None = None
    record: RunRecord = NOT_RECORDED

    @property
    def springs(self) -> tuple[str, ...]:
        """Names of stiffnesses and dampings, stiffness first."""
        return self.fit.springs

    @property
    def residuals(self) -> tuple[np.ndarray, ...]:
        """Complex errors (L, n, n) of every pose, as in the fit (Eq. 27): of log Ĝ/G, or of Ĝ where it is poorly determined."""
        return self.fit.errors

    @property
    def headline(self) -> str:
        """Number of springs and poses, and the reduced chi-square."""
        identified = sum(self.estimate.std(name) is not None for name in self.springs)
        chi2 = self.estimate.reduced_chi2
        return (
            f"{identified} of {len(self.springs)} stiffnesses and dampings from {len(self.responses)} "
            f"{'pose' if len(self.responses) == 1 else 'poses'}, "
            f"{self.estimate.status if chi2 is None else f'reduced chi-square {chi2:.2f}'}"
        )

    def summary(self) -> str:
        """Stiffness and damping with their standard deviations, remarks and verdict."""
        rows = [estimate_row(self.estimate, name) for name in self.springs]
        return "\n".join([self.headline, *rows, *self.remarks, self.trust.sentence])

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(stiffness_checks(self.estimate, response_bearings_block(self.fit.bearings), self._scale))

    @property
    def _scale(self) -> dict[str, Any] | None:
        return None if self.fit.scale is None else self.fit.scale.document()

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        estimate = self.estimate
        return {
            **header("stiffness"),
            "stage1": springs_block(estimate),
            "fit": {
                "status": estimate.status,
                "message": estimate.message,
                "reduced_chi2": estimate.reduced_chi2,
                "misfit": misfit_document(estimate.misfit),
                "torque_scale": self._scale,
                "rank": estimate.rank,
                "reference_motion_modelled": self.reference_known,
                "missing_poses": list(self.missing_poses),
                "dropped": dropped_parameters(estimate.dropped),
            },
            "bearings": response_bearings_block(self.fit.bearings),
            "further_joints": list(self.further_joints),
            "pooled": None if self.pooled is None else self.pooled.document(),
            "remarks": list(self.remarks),
            "parameters": quantities(estimate),
            "verdict": self.trust.document(),
            "robot": self.model.name,
            "estimates": self.estimates,
            "command": self.record.command,
        }

    def write_arrays(self, folder: Path) -> None:
        """Leave fitted_responses.npz in a folder."""
        write_fitted_responses(folder, self.responses)
