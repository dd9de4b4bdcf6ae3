"""Identified tip of a tool, and the content of its results.json."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.touching import TipFit
from flexcal.jobs.result_files import header
from flexcal.jobs.touching import TouchIdentification, half_widths, millimetres
from flexcal.units import DEGREE, MILLIMETRE

_FEW = 5
"""Number of touches of a point below which a wrong one cannot be told from the others."""
_SMALL_TURN = 10 * DEGREE
"""Rotation of the tool below which the tip is determined poorly."""
_NORMAL = 1.96
"""Half width of an interval of 95 % over the standard deviation, of a normal distribution."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ToolIdentification(TouchIdentification):
    """Result of `identify_tip`.

    Attributes
    ----------
    fit : TipFit
        The fit, in the `frame`.
    frame : str
        URDF frame in which the tip is.
    """

    fit: TipFit
    frame: str

    @property
    def touch_fit(self) -> TipFit:
        """The fit."""
        return self.fit

    @property
    def xyz(self) -> np.ndarray:
        """The tip (3,) in the frame, m."""
        return self.fit.xyz

    @property
    def half_width(self) -> np.ndarray:
        """Half widths (3,) of the intervals of 95 %, m, in the frame of the real robot."""
        return np.hypot(self.own_half_width, _NORMAL * np.sqrt(np.diag(self.fit.flange)))

    @property
    def own_half_width(self) -> np.ndarray:
        """The same in the frame as the robot of robot.yaml and its estimates has it, which commands and exports use, m."""
        return half_widths(self.fit.fit)[:3]

    @property
    def headline(self) -> str:
        """The tip with its interval."""
        return f"{self.name} at {millimetres(self.xyz, self.half_width)} in {self.frame}"

    @property
    def lines(self) -> list[str]:
        """The line for robot.yaml."""
        place, std = (
            ", ".join(f"{value:.6f}" for value in values)
            for values in (self.xyz, self.own_half_width / _NORMAL)
        )
        return [f"points: {{{self.name}: {{frame: {self.frame}, xyz: [{place}], std: [{std}]}}}}"]

    @property
    def remarks(self) -> list[str]:
        """What the residual comes from, and what the touches do not show."""
        fit, kept = self.fit, int(self.fit.kept.sum())
        said = [self.residual_remark("the points that it touched"), *self.outlier_remarks()]
        if kept < _FEW * len(fit.points):
            said.append(
                f"with {kept} touches a wrong one may not be seen; touch the point again in other orientations, {_FEW} times or more"
            )
        if fit.turn < _SMALL_TURN:
            said.append(
                f"the tool turned by {fit.turn / DEGREE:.1f}° only about the axis about which it turned least; turn it by 30° or more "
                "about two axes for a narrower interval"
            )
        if fit.flange.any():
            own = ", ".join(f"{value / MILLIMETRE:.2f}" for value in self.own_half_width)
            said.append(
                f"the line for robot.yaml is in {self.frame} as this calibration has it, as commands and exports are; there the tip is "
                f"known to ± ({own}) mm. How {self.frame} lies on the last link no measured point tells, which widens the interval"
            )
        said.append("the orientation of the tool cannot be told from points; it is that of the frame")
        return said

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {
            **header("tool"),
            "robot": self.model.name,
            "name": self.name,
            "frame": self.frame,
            "xyz_m": self.xyz,
            "half_width_m": self.half_width,
            "own_half_width_m": self.own_half_width,
            "degrees_of_freedom": self.fit.fit.freedom,
            **self.residual_document(),
            "turn_deg": self.fit.turn / DEGREE,
            "touches": self.touch_rows(),
            "remarks": self.remarks,
            **self.record.document(),
        }
