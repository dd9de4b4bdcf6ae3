"""What measured points say of robot.yaml's `bearings:`."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.calibration import BearingAxes, Calibration
from flexcal.elasticity import ResponseBearings
from flexcal.units import MILLIMETRE

_AXES = {"before": "fixed to the parent link", "after": "that turn with the child link"}


def bearing_remarks(axes: BearingAxes | None, fit: Calibration) -> tuple[str, ...]:
    """A sentence where the points of a `fit` decided on the bearing axes, or contradict the declared ones."""
    if axes is None or axes.preferred is None or axes.preferred == axes.declared:
        return ()
    other = "after" if axes.preferred == "before" else "before"
    better, worse = (f"{axes.errors[key].mean / MILLIMETRE:.3f} mm" for key in (axes.preferred, other))
    found = f"the points fit bearing axes {_AXES[axes.preferred]} better (mean error {better}) than axes {_AXES[other]} ({worse})"
    if axes.declared is None:
        return (f"{found}: these were taken; `bearings: {axes.preferred}` in robot.yaml declares them",)
    springs = (p for p in fit.prior.parameters if p.name.endswith(".stiffness"))
    identified = any(np.isinf(spring.prior_std) for spring in springs)  # by stage 1, with the declared ones
    again = ", run 'flexcal identify stiffness' again" if identified else ""
    return (f"{found}: write `bearings: {axes.preferred}` in robot.yaml{again} and calibrate again",)


def bearings_block(axes: BearingAxes | None) -> dict[str, Any] | None:
    """As results.json has it."""
    if axes is None:
        return None
    return {
        "declared": axes.declared,
        "preferred": axes.preferred,
        "statistic": axes.statistic,
        "errors": {bearings: errors.in_millimetres() for bearings, errors in axes.errors.items()},
    }


def response_bearings_block(bearings: ResponseBearings | None) -> dict[str, Any] | None:
    """As results.json of stage 1 has it."""
    if bearings is None:
        return None
    return {
        "declared": bearings.declared,
        "preferred": bearings.preferred,
        "statistic": bearings.statistic,
        "reduced_chi2": dict(bearings.reduced_chi2),
    }


def response_bearings_remarks(bearings: ResponseBearings | None) -> tuple[str, ...]:
    """A sentence where frequency responses decided on the bearing axes, or contradict the declared ones."""
    if bearings is None or bearings.preferred is None or bearings.preferred == bearings.declared:
        return ()
    better, other = bearings.preferred, "after" if bearings.preferred == "before" else "before"
    chi2 = bearings.reduced_chi2
    found = f"the responses fit bearing axes {_AXES[better]} better (reduced chi-square {chi2[better]:.2f}, else {chi2[other]:.2f})"
    if bearings.contradicted:
        return (f"{found}: write `bearings: {better}` in robot.yaml and identify again",)
    return (f"{found}: these were taken; `bearings: {better}` in robot.yaml declares them",)
