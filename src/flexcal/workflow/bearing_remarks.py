"""What measured points say of robot.yaml's `bearings:`."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.calibration import BearingAxes, Calibration
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
