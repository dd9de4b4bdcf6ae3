"""Identification of a work object: a robot model and touches of its points or faces in, its frame out."""

from __future__ import annotations

from flexcal.calibration.touching import fit_frame
from flexcal.data.poses import FrameTouches
from flexcal.errors import FlexcalError
from flexcal.jobs.frame.result import FrameIdentification
from flexcal.model.robot import RobotModel


def identify_work_object(
    model: RobotModel,
    given: FrameTouches,
    *,
    point: str | None = None,
    name: str = "work_object",
    tip_radius: float = 0.0,
) -> FrameIdentification:
    """Find the frame of a work object in the base frame, from poses in which the tip of a tool touched it.

    Parameters
    ----------
    model : RobotModel
        Robot, calibrated or not: what its calibration leaves, or typical errors of joints, are correlated errors of the touches.
    given : FrameTouches
        Touches of points of known coordinates, of three faces (3-2-1), or of an origin and points of the axes.
    point : str, optional
        Name of the tip under `points:` of robot.yaml; by default the first.
    name : str
        Name of the work object.
    tip_radius : float
        Radius of a ball at the tip that touched faces, m; 0 for a sharp tip.

    Returns
    -------
    FrameIdentification
        Its `origin`, `rotation`, `half_width`, `outliers`, `summary()` and `document()`.

    Raises
    ------
    FlexcalError
        For an unknown tip, touches that define no frame, and points that are exchanged, mirrored or in another unit.
    """
    tip = point or next(iter(model.points), None)
    if tip is None:
        raise FlexcalError(
            "E-TOOL-025",
            f"{model.path.name} declares no tip under `points:`; find it with 'flexcal identify tool', and copy its line there.",
        )
    if not 0 <= tip_radius < 0.1:
        raise FlexcalError(
            "E-TOOL-026", f"the radius of the tip is {tip_radius * 1e3:g} mm; it must be from 0 to 100 mm."
        )
    if tip_radius and given.method != "faces":
        raise FlexcalError(
            "E-TOOL-027",
            "a radius of the tip counts for faces only; the centre of a ball that touches a point is somewhere about it.",
        )
    fit = fit_frame(model, given, tip, tip_radius=tip_radius)
    return FrameIdentification(model, given.touches, name, fit=fit, point=tip, method=given.method)
