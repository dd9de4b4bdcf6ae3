"""Base of the results of identifications from touches: who disagrees, and whose error the residual is."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.touching import TouchFit
from flexcal.data.poses import Touches
from flexcal.estimation import TwoVarianceFit, student_quantile
from flexcal.jobs.pages import Result
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord
from flexcal.units import MILLIMETRE


def half_widths(fit: TwoVarianceFit) -> np.ndarray:
    """Half widths (p,) of the intervals of 95 % of the estimates."""
    return student_quantile(0.975, fit.freedom) * np.sqrt(np.diag(fit.covariance))


def millimetres(xyz: np.ndarray, half_width: np.ndarray) -> str:
    """A place (3,), m, with the half widths (3,) of its intervals, in mm, for people."""
    numbers = (
        f"{value / MILLIMETRE:.2f} ± {half / MILLIMETRE:.2f}"
        for value, half in zip(xyz, half_width, strict=True)
    )
    return f"({', '.join(numbers)}) mm"


@dataclass(frozen=True, eq=False, repr=False)
class TouchIdentification(Result):
    """Result of an identification from touches.

    Attributes
    ----------
    model : RobotModel
        The robot as it was given.
    touches : Touches
        The touches.
    name : str
        Name of what was identified.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    touches: Touches
    name: str
    record: RunRecord = NOT_RECORDED

    @property
    @abstractmethod
    def touch_fit(self) -> TouchFit:
        """The fit."""

    @property
    @abstractmethod
    def remarks(self) -> list[str]:
        """What the residual comes from, and what the touches do not show."""

    @property
    @abstractmethod
    def lines(self) -> list[str]:
        """Lines to copy."""

    @property
    def outliers(self) -> list[str]:
        """Touches that do not agree with the others."""
        return [self.touches.label(int(i)) for i in np.flatnonzero(~self.touch_fit.kept)]

    def residual_remark(self, what: str) -> str:
        """How far the touches are from `what` they touched, and how much of it is the arm's."""
        fit = self.touch_fit
        arm, rms = fit.arm_rms / MILLIMETRE, fit.rms / MILLIMETRE
        of_arm = (
            "what its calibration leaves"
            if fit.arm.calibrated
            else "errors of its joints, which is not calibrated"
        )
        return (
            f"the tip is {rms:.3f} mm rms from {what}; {min(arm, rms):.3f} mm of that may come from the arm ({of_arm}), and "
            f"{fit.fit.median_noise / MILLIMETRE:.3f} mm per coordinate from touching"
        )

    def outlier_remarks(self) -> list[str]:
        """The touches that were left out, if there are any."""
        if not self.outliers:
            return []
        return [
            f"{len(self.outliers)} touches do not agree with the others and were left out: {'; '.join(self.outliers)}"
        ]

    def summary(self) -> str:
        """The result with its interval, the lines to copy, and the remarks."""
        return "\n".join([self.headline, *self.lines, *self.remarks])

    def residual_document(self) -> dict[str, Any]:
        """Entries of results.json on the residual."""
        fit = self.touch_fit
        return {
            "arm_calibrated": fit.arm.calibrated,
            "rms_mm": fit.rms / MILLIMETRE,
            "arm_rms_mm": fit.arm_rms / MILLIMETRE,
            "touching_mm": fit.fit.median_noise / MILLIMETRE,
        }

    def touch_rows(self) -> list[dict[str, Any]]:
        """Entries of results.json on every touch."""
        fit = self.touch_fit
        return [
            {
                "pose": int(self.touches.pose[i]),
                "point": str(self.touches.touched[i]),
                "error_mm": float(fit.distances[i]) / MILLIMETRE,
                "kept": bool(fit.kept[i]),
            }
            for i in range(len(self.touches))
        ]
