"""What measured points say of robot.yaml's `bearings:`."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.calibration import BearingAxes, Calibration
from flexcal.units import MILLIMETRE

_AXES = {"before": "fixed to the parent link", "after": "that turn with the child link"}


def bearing_remarks(axes: BearingAxes | None, fit: Calibration) -> tuple[str, ...]:
    """A sentence where the points of a `fit` contradict robot.yaml."""
    if axes is None or axes.preferred is None or not axes.contradicted:
        return ()
    springs = (p for p in fit.prior.parameters if p.name.endswith(".stiffness"))
    identified = any(
        np.isinf(spring.prior_std) for spring in springs
    )  # by stage 1, with the bearings as declared
    again = ", run 'flexcal identify stiffness' again" if identified else ""
    errors = (axes.errors.mean, axes.other_errors.mean)
    declared, other = (f"{error / MILLIMETRE:.3f} mm" for error in errors)
    return (
        f"the points fit bearing axes {_AXES[axes.preferred]} better (mean error {other}) than axes {_AXES[axes.declared]} "
        f"({declared}): write `bearings: {axes.preferred}` in robot.yaml{again} and calibrate again",
    )


def bearings_block(axes: BearingAxes | None) -> dict[str, Any] | None:
    """As results.json has it."""
    if axes is None:
        return None
    return {
        "declared": axes.declared,
        "preferred": axes.preferred,
        "statistic": axes.statistic,
        "errors": axes.errors.in_millimetres(),
        "other_errors": axes.other_errors.in_millimetres(),
    }
