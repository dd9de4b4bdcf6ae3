"""Identified frame of a work object, and the content of its results.json."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.calibration.touching import FrameFit
from flexcal.data.poses import FrameMethod
from flexcal.jobs.frame.controller_forms import controller_forms
from flexcal.jobs.result_files import header
from flexcal.jobs.touching import TouchIdentification, half_widths, millimetres
from flexcal.model.parts import rotation_rpy, rotation_vector, rotation_wxyz
from flexcal.units import DEGREE, MILLIMETRE

_FEW = {"points": 5, "faces": 9, "origin_x_xy": 9, "x1_x2_y1": 9}
"""Number of touches below which a wrong one cannot be told from the others."""
_TOUCHED = {
    "points": "the points that it touched",
    "faces": "the faces that it touched",
    "origin_x_xy": "the origin, axis and plane that it touched",
    "x1_x2_y1": "the axes that it touched",
}


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FrameIdentification(TouchIdentification):
    """Result of `identify_work_object`.

    Attributes
    ----------
    fit : FrameFit
        The fit.
    point : str
        Tip that touched, as robot.yaml names it.
    method : FrameMethod
        What defines the frame.
    """

    fit: FrameFit
    point: str
    method: FrameMethod

    @property
    def touch_fit(self) -> FrameFit:
        """The fit."""
        return self.fit

    @property
    def origin(self) -> np.ndarray:
        """Origin (3,) of the work object in the base frame, m."""
        return self.fit.origin

    @property
    def rotation(self) -> np.ndarray:
        """Axes (3, 3) of the work object in the base frame, as columns."""
        return self.fit.rotation

    @property
    def half_width(self) -> np.ndarray:
        """Half widths (3,) of the intervals of 95 % of the origin, m; of the arm's errors alone where touching is not known."""
        return half_widths(self.fit.fit)[:3]

    @property
    def angular_half_width(self) -> np.ndarray:
        """The same of small rotations about the axes of the work object, rad."""
        own, covariance = self.rotation, self.fit.fit.covariance[3:, 3:]
        spread = np.sqrt(np.diag(own.T @ covariance @ own) / np.diag(covariance))
        return half_widths(self.fit.fit)[3:] * spread

    @property
    def headline(self) -> str:
        """Origin and orientation with their intervals."""
        angles = ", ".join(f"{value / DEGREE:.3f}" for value in rotation_rpy(self.rotation))
        turned = ", ".join(f"{value / DEGREE:.3f}" for value in self.angular_half_width)
        return (
            f"{self.name} at {millimetres(self.origin, self.half_width)} in the base frame, roll, pitch, yaw ({angles})°, ± ({turned})° "
            "about its x, y, z"
        )

    @property
    def lines(self) -> list[str]:
        """The frame as controllers write it."""
        return [
            f"{controller}: {text}"
            for controller, text in controller_forms(self.origin, self.rotation, self.name).items()
        ]

    @property
    def remarks(self) -> list[str]:
        """What the residual comes from, and what the touches do not show."""
        fit, kept = self.fit, int(self.fit.kept.sum())
        if fit.noise_is_known:
            said = [self.residual_remark(_TOUCHED[self.method]), *self.outlier_remarks()]
        else:
            said = [
                "these touches define the frame and leave no residual, so what touching adds to the interval is not known: it is that of "
                "the arm's errors alone; touch every point or face twice"
            ]
        if kept < _FEW[self.method] and fit.noise_is_known:
            said.append(
                f"with {kept} touches a wrong one may not be seen; touch {_FEW[self.method]} times or more"
            )
        said += self._checks()
        if fit.noise_is_known:
            alone = ", ".join(f"{2 * std / MILLIMETRE:.2f}" for std in fit.touching)
            share = f"touching alone would leave the origin to about ± ({alone}) mm; the rest of its interval is the arm's"
            again = "; where the arm touched, with the tool in the same orientation, its errors come again and cancel for the most part"
            said.append(share + ("" if fit.arm.calibrated else again))
        return said

    def _checks(self) -> list[str]:
        fit, said = self.fit, []
        if fit.size is not None:
            thousandth, half = fit.size.deviation * 1e3, fit.size.half_width * 1e3
            away = " and differ from them" if abs(thousandth) > half else ""
            said.append(
                f"the points were touched {1 + fit.size.deviation:.5f} ± {fit.size.half_width:.5f} times as far from each other as their "
                f"coordinates say{away} ({thousandth:+.2f} ± {half:.2f} mm per m)"
            )
        other = fit.other_order
        if other is not None:
            said.append(
                f"the names cannot be checked: with {other.names} exchanged the points fit too ({other.rms / MILLIMETRE:.2f} mm rms); a "
                "further point that spoils the symmetry tells"
            )
        if not fit.from_tool:
            said.append(
                "the z axis points away from the tool, into what it touched; if it should not, exchange two points or reverse an axis"
            )
        if self.method == "faces":
            low, high = (f(self._of_face("1")[:, :2], axis=0) / MILLIMETRE for f in (np.min, np.max))
            said.append(
                f"face 1 was touched at x = {low[0]:.0f} to {high[0]:.0f} and y = {low[1]:.0f} to {high[1]:.0f} mm; x runs from the first "
                "to the last touch of face 2"
            )
        return said

    def _of_face(self, name: str) -> np.ndarray:
        return self.fit.coordinates[self.touches.touched == name]

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        fit = self.fit
        return {
            **header("frame"),
            "robot": self.model.name,
            "name": self.name,
            "tip": self.point,
            "method": self.method,
            "xyz_m": self.origin,
            "half_width_m": self.half_width,
            "rpy_rad": rotation_rpy(self.rotation),
            "quaternion_wxyz": rotation_wxyz(self.rotation),
            "rotation_vector_rad": rotation_vector(self.rotation),
            "half_width_rad": self.angular_half_width,
            "touching_std_m": fit.touching if fit.noise_is_known else None,
            "degrees_of_freedom": fit.fit.freedom,
            "touching_known": fit.noise_is_known,
            **self.residual_document(),
            "size": None
            if fit.size is None
            else {"deviation": fit.size.deviation, "half_width": fit.size.half_width},
            "controllers": controller_forms(self.origin, self.rotation, self.name),
            "touches": self.touch_rows(),
            "remarks": self.remarks,
            **self.record.document(),
        }
