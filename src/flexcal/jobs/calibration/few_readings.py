"""Remark on a calibration from few readings."""

from __future__ import annotations

from flexcal.calibration.fit import GeometricFit

_FEW = 20
"""Degrees of freedom below which a standard deviation is known to worse than 16 %."""


def few_readings_remarks(fit: GeometricFit) -> tuple[str, ...]:
    """How well so few readings tell the scatter that all uncertainties rest on, where it is estimated from them."""
    freedom = fit.estimate.degrees_of_freedom
    if fit.variances["robot_mm"] is None or not 0 < freedom < _FEW:
        return ()
    return (
        f"the readings leave {freedom} degrees of freedom beside the parameters: the scatter, and with it every "
        f"uncertainty, is known to ±{100 * (2 * freedom) ** -0.5:.0f} % (1σ) only; measure more poses ('flexcal design poses --measured')",
    )
