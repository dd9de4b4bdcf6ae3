"""Checks of a calibration with terms of temperature: what else may stand behind them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import Check, document_millimetres

_ATTENUATED = 0.1
"""Share by which coefficients are too small from which the result is to be used with care."""
_SCATTERED = 1.5
"""χ² per degree of freedom, from which an imprecise temperature may be what scatters."""


def check_instrument_change(told: Mapping[str, Any]) -> Check:
    """An instrument whose readings change, as its term says; `told` is the block of results.json."""
    answer = (
        f"The instrument's readings change with temperature or time, by {document_millimetres(told['instrument_mm'])} mm over the measured "
        "temperatures. The calibration takes it into account; if the instrument drifts, let it warm up, and measure again."
    )
    return Check("Did the instrument drift during the measurement?", answer, "care").named(
        "instrument_change"
    )


def check_temperature_sensor(told: Mapping[str, Any], fit: Mapping[str, Any]) -> tuple[Check, ...]:
    """Whether the temperature's sensor lags, or its noise makes coefficients too small; none where neither does, or nothing tells."""
    question = "Was the temperature measured well enough?"
    lag = told.get("sensor_lag")
    if lag is not None and lag["certain"]:
        size = (
            f"{abs(lag['lag']) / 60:.2g} min" if lag["unit"] == "s" else f"{abs(lag['lag']):.2g} measurements"
        )
        answer = (
            f"Its temperatures {'lag behind' if lag['lag'] > 0 else 'are ahead of'} those of the arm by {size}, which explains "
            f"{lag['share']:.0%} of the squares of the residuals."
        )
    elif told["attenuation"] > _ATTENUATED:
        answer = f"Its sensor scatters by {told['sensor_std']:.2g} K, which makes coefficients {told['attenuation']:.0%} too small."
    elif told["sensor_std"] is None and fit["sigma_given"] and (fit["reduced_chi2"] or 0.0) > _SCATTERED:
        answer = (
            "The noise of its sensor is not known, and the readings scatter more than the stated sigma says, as an imprecise temperature "
            "makes them: the coefficients may be far too small."
        )
    else:
        return ()
    return (Check(question, answer, "care").named("temperature_sensor"),)
