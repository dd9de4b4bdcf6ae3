"""Columns of a task's row."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Any

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.estimation import Estimate

QUANTITIES = ("estimate", "std", "low", "high", "truth")
"""What is stored of every parameter, in columns named `<parameter>.<quantity>`."""


def parameter_columns(
    estimate: Estimate, truth: Mapping[str, float] | None = None, other: Container[str] = ()
) -> dict[str, float]:
    """Estimate, standard deviation, 95 % interval and true value of every identifiable parameter, SI units, without the `other` ones.

    True values are those that the estimate is expected to have: parameters that the data cannot tell apart are mapped into the kept ones.
    """
    expected = estimate.regrouped(truth) if truth else {}
    columns: dict[str, float] = {}
    for name in estimate.parameters.names:
        interval, std = estimate.interval(name), estimate.std(name)
        if interval is None or std is None or name in other:
            continue
        values = {"estimate": estimate.values[name], "std": std, "low": interval[0], "high": interval[1]}
        if truth and name in truth:
            values["truth"] = expected[name]
        columns |= {f"{name}.{quantity}": float(value) for quantity, value in values.items()}
    return columns


def error_columns(name: str, errors: ErrorStatistics) -> dict[str, float | None]:
    """Mean, 90th percentile and maximum of errors, mm."""
    return {f"{name}.{key}": value for key, value in errors.in_millimetres().items() if key.endswith("_mm")}


def fit_columns(estimate: Estimate, variances: Mapping[str, float | None]) -> dict[str, Any]:
    """Reduced χ², rank and the uncertainty budget of a measured point, mm."""
    return {"reduced_chi2": estimate.reduced_chi2, "rank": estimate.rank} | dict(variances)
