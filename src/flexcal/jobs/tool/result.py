"""Identified tip of a tool, and the content of its results.json."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.touching import TipFit
from flexcal.data.poses import Touches
from flexcal.estimation import student_quantile
from flexcal.jobs.pages import Result
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header
from flexcal.units import DEGREE, MILLIMETRE

_FEW = 5
"""Number of touches of a point below which a wrong one cannot be told from the others."""
_SMALL_TURN = 10 * DEGREE
"""Rotation of the tool below which the tip is determined poorly."""


@dataclass(frozen=True, eq=False, repr=False)
class ToolIdentification(Result):
    """Result of `identify_tip`.

    Attributes
    ----------
    model : RobotModel
        The robot as it was given.
    fit : TipFit
        The fit, in the `frame`.
    touches : Touches
        The touches.
    frame : str
        URDF frame in which the tip is.
    name : str
        Name of the tip.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    fit: TipFit
    touches: Touches
    frame: str
    name: str
    record: RunRecord = NOT_RECORDED

    @property
    def xyz(self) -> np.ndarray:
        """The tip (3,) in the frame, m."""
        return self.fit.xyz

    @property
    def half_width(self) -> np.ndarray:
        """Half widths (3,) of the intervals of 95 %, m."""
        spread = np.sqrt(np.diag(self.fit.fit.covariance)[:3])
        return student_quantile(0.975, self.fit.fit.freedom) * spread

    @property
    def outliers(self) -> list[str]:
        """Touches that do not agree with the others."""
        return [self.touches.label(int(i)) for i in np.flatnonzero(~self.fit.kept)]

    @property
    def headline(self) -> str:
        """The tip with its interval."""
        numbers = ", ".join(
            f"{value / MILLIMETRE:.2f} ± {half / MILLIMETRE:.2f}"
            for value, half in zip(self.xyz, self.half_width, strict=True)
        )
        return f"{self.name} at ({numbers}) mm in {self.frame}"

    @property
    def line(self) -> str:
        """Line for robot.yaml."""
        place = ", ".join(f"{value:.6f}" for value in self.xyz)
        return f"points: {{{self.name}: {{frame: {self.frame}, xyz: [{place}]}}}}"

    @property
    def remarks(self) -> list[str]:
        """What the residual comes from, and what the touches do not show."""
        fit, kept = self.fit, int(self.fit.kept.sum())
        arm, rms = fit.arm_rms / MILLIMETRE, fit.rms / MILLIMETRE
        of_arm = (
            "what its calibration leaves"
            if fit.arm.calibrated
            else "errors of its joints, which is not calibrated"
        )
        said = [
            f"the tip is {rms:.3f} mm rms from the points that it touched; {min(arm, rms):.3f} mm of that may come from the arm ("
            f"{of_arm}), and {fit.fit.noise / MILLIMETRE:.3f} mm per coordinate from touching"
        ]
        if self.outliers:
            said.append(
                f"{len(self.outliers)} touches do not agree with the others and were left out: {'; '.join(self.outliers)}"
            )
        if kept < _FEW * len(fit.points):
            said.append(
                f"with {kept} touches a wrong one may not be seen; touch the point again in other orientations, {_FEW} times or more"
            )
        if fit.turn < _SMALL_TURN:
            said.append(
                f"the tool turned by {fit.turn / DEGREE:.1f}° only about the axis about which it turned least; turn it by 30° or more "
                "about two axes for a narrower interval"
            )
        said.append("the orientation of the tool cannot be told from points; it is that of the frame")
        return said

    def summary(self) -> str:
        """The tip with its interval, the line for robot.yaml, and the remarks."""
        return "\n".join([self.headline, self.line, *self.remarks])

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        fit = self.fit
        return {
            **header("tool"),
            "robot": self.model.name,
            "name": self.name,
            "frame": self.frame,
            "xyz_m": self.xyz,
            "half_width_m": self.half_width,
            "degrees_of_freedom": fit.fit.freedom,
            "arm_calibrated": fit.arm.calibrated,
            "rms_mm": fit.rms / MILLIMETRE,
            "arm_rms_mm": fit.arm_rms / MILLIMETRE,
            "touching_mm": fit.fit.noise / MILLIMETRE,
            "turn_deg": fit.turn / DEGREE,
            "touches": [
                {
                    "pose": int(self.touches.pose[i]),
                    "point": str(self.touches.touched[i]),
                    "error_mm": float(fit.distances[i]) / MILLIMETRE,
                    "kept": bool(fit.kept[i]),
                }
                for i in range(len(self.touches))
            ],
            "remarks": self.remarks,
            **self.record.document(),
        }
