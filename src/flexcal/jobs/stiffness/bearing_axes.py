"""Remarks on the bearing axes that measured points or frequency responses prefer (`bearings:` of robot.yaml)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from flexcal.calibration.diagnostics import BearingAxes
from flexcal.calibration.fit import GeometricFit
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.elasticity.identification import ResponseBearings

_AXES = {"before": "fixed to the parent link", "after": "that turn with the child link"}


def bearing_remarks(axes: BearingAxes | None, fit: GeometricFit) -> tuple[str, ...]:
    """Remark if the points of a `fit` determined the bearing axes, or contradict the declared ones."""
    if axes is None:
        return ()
    springs = (p for p in fit.prior.parameters if p.name.endswith(".stiffness"))
    identified = any(np.isinf(spring.prior_std) for spring in springs)  # by stage 1, with the declared ones
    again = (
        ", run 'flexcal identify stiffness' again and calibrate again"
        if identified
        else " and calibrate again"
    )
    errors = {key: f"mean error {own.mean / MILLIMETRE:.3f} mm" for key, own in axes.errors.items()}
    return _remarks("points", axes, errors, again)


def response_bearings_remarks(bearings: ResponseBearings | None) -> tuple[str, ...]:
    """Remark if frequency responses determined the bearing axes, or contradict the declared ones."""
    if bearings is None:
        return ()
    chi2 = {key: f"reduced chi-square {own:.2f}" for key, own in bearings.reduced_chi2.items()}
    if bearings.undecided:
        both = " and ".join(f"axes {_AXES[key]} ({own})" for key, own in chi2.items())
        return (
            f"bearing {both} fit the responses equally well within chance: axes {_AXES[bearings.taken]} were used, and the intervals of "
            "the springs include the difference; `bearings:` in robot.yaml declares which ones the robot has",
        )
    return _remarks("responses", bearings, chi2, " and identify again")


def _remarks(
    what: str, bearings: BearingAxes | ResponseBearings, figures: Mapping[str, str], again: str
) -> tuple[str, ...]:
    better = bearings.preferred
    if better is None or better == bearings.declared:
        return ()
    other = "after" if better == "before" else "before"
    comparison = (
        f"the {what} fit bearing axes {_AXES[better]} better ({figures[better]}) "
        f"than axes {_AXES[other]} ({figures[other]})"
    )
    if bearings.declared is None:
        return (f"{comparison}: these were used; `bearings: {better}` in robot.yaml declares them",)
    return (f"{comparison}: write `bearings: {better}` in robot.yaml{again}",)


def bearings_block(axes: BearingAxes | None) -> dict[str, Any] | None:
    """Block of results.json of a calibration."""
    if axes is None:
        return None
    return _block(axes) | {"errors": {key: errors.in_millimetres() for key, errors in axes.errors.items()}}


def response_bearings_block(bearings: ResponseBearings | None) -> dict[str, Any] | None:
    """Block of results.json of stage 1."""
    return None if bearings is None else _block(bearings) | {"reduced_chi2": dict(bearings.reduced_chi2)}


def _block(bearings: BearingAxes | ResponseBearings) -> dict[str, Any]:
    return {
        "declared": bearings.declared,
        "preferred": bearings.preferred,
        "statistic": bearings.statistic,
    }
