"""Remarks on the temperature of a calibration: what it changes, and what it cannot be told from."""

from __future__ import annotations

from typing import Any

from flexcal.calibration.diagnostics import SensorLag
from flexcal.calibration.fit import GeometricFit, TemperatureEvidence
from flexcal.model.robot import EXPANSION, STATION_DRIFT
from flexcal.report.results import chance_in_words
from flexcal.units import MILLIMETRE

_MICRO = 1e-6
_METALS = 30.0
"""Expansion, µm/m/K, above that of aluminium and magnesium."""
_IRON = 10.0
"""Expansion, µm/m/K, below that of cast iron and steel."""
_WORTH = 0.02
"""Attenuation from which it has a sentence."""


def thermal_remarks(fit: GeometricFit, lag: SensorLag | None) -> tuple[str, ...]:
    """Remarks on a fit with terms of temperature, whose sensor may `lag`; none for others."""
    told = fit.temperature
    if told is None:
        return ()
    remarks = [_expansion(fit, told)]
    if told.confounded:
        remarks.append(_confounded(told))
    if lag is not None and lag.certain:
        remarks.append(_lagging(lag))
    elif told.drifts:
        remarks.append(
            f"beside temperature, residuals change with {_clock(told)} ({chance_in_words(told.probability)}): something drifts that the "
            "temperature column does not say, as the instrument, or a link that warms up later or earlier than the sensor"
        )
    if told.scatter is None:
        remarks.append(
            "the noise of the temperature's sensor is not known, because temperatures jump from one measurement to the next: a sensor that "
            f"scatters by s K makes coefficients too small by (s / {told.spread:.1f} K)², which the intervals do not include"
        )
    elif told.attenuation > _WORTH:
        remarks.append(
            f"the temperature's sensor scatters by {told.scatter:.2g} K from one measurement to the next, which makes coefficients "
            f"{told.attenuation:.0%} too small; the intervals include it"
        )
    return tuple(remarks)


def thermal_document(fit: GeometricFit, lag: SensorLag | None) -> dict[str, Any] | None:
    """Block `temperature` of results.json, with the `lag` of the sensor; None for a robot that does not change with it."""
    told = fit.temperature
    if told is None:
        return None
    return {
        "reference": told.reference,
        "lowest": told.lowest,
        "highest": told.highest,
        "timed": told.timed,
        "correlation": told.correlation,
        "confounded": told.confounded,
        "drift_p": told.probability,
        "sensor_std": told.scatter,
        "sensor_lag": None if lag is None else lag.document(),
        "attenuation": told.attenuation,
        "instrument_mm": None if (change := _instrument_change(fit, told)) is None else change / MILLIMETRE,
        "parameters": {
            name: {"std": told.wide[name], "std_without_time": narrow} for name, narrow in told.narrow.items()
        },
    }


def _lagging(lag: SensorLag) -> str:
    """What a sensor does that is slower, or faster, than the arm."""
    half = 1.96 * lag.std
    size = (
        f"{abs(lag.lag) / 60:.2g} ± {half / 60:.1g} min"
        if lag.timed
        else f"{abs(lag.lag):.2g} ± {half:.1g} measurements"
    )
    return (
        f"the temperatures {'lag behind' if lag.lag > 0 else 'are ahead of'} those of the arm by {size} (95 %), which explains "
        f"{lag.share:.0%} of the squares of the residuals ({chance_in_words(lag.probability)}): fix the sensor to the arm itself, at a "
        "link that warms up as the others do, or measure when both have settled; a prediction while the arm warms up is off by as much"
    )


def _expansion(fit: GeometricFit, told: TemperatureEvidence) -> str:
    """What the calibrated robot does with temperature."""
    where = (
        f"the calibrated parameters hold at {told.reference:.1f} °C, and temperatures were from {told.lowest:.1f} to "
        f"{told.highest:.1f} °C"
    )
    interval = fit.estimate.interval(EXPANSION) if EXPANSION in fit.estimate.parameters else None
    change = _instrument_change(fit, told)
    if change is not None and all(_is_of_station(name) for name in told.narrow):
        return (
            f"the instrument's readings change with temperature or time, by {change / MILLIMETRE:.3f} mm over the measured "
            f"temperatures, and no term of the robot itself was taken: {where}"
        )
    if interval is None:
        return f"the robot changes with temperature: {where}"
    low, high = (limit / _MICRO for limit in interval)
    of = "longest link" if any(name.endswith(".thermal_expansion") for name in told.narrow) else "arm"
    odd = ""
    if low > _METALS or high < 0:
        odd = (
            ", which no arm's material does: the column is not the temperature of the links, or something else goes with it, as the scale "
            "of the instrument"
        )
    elif high < _IRON and low > 0:
        odd = (
            ", less than cast iron or steel does: if the column is in Fahrenheit, declare `unit: degF` for it under `signals:`; else its "
            "sensor warms up more than the links, or scatters"
        )
    size = f"{(low + high) / 2:.1f} ± {(high - low) / 2:.1f} µm/m"
    return f"the {of} expands by {size} per kelvin of the column 'temperature' (95 %){odd}; {where}"


def _instrument_change(fit: GeometricFit, told: TemperatureEvidence) -> float | None:
    """Largest change of an instrument's readings over the measured temperatures, m; None without such a term."""
    of: dict[str, float] = {}
    for name in filter(_is_of_station, told.narrow):
        station = name.rpartition(".")[0]
        of[station] = of.get(station, 0.0) + fit.estimate.values[name] ** 2
    return max(of.values()) ** 0.5 * (told.highest - told.lowest) if of else None


def _is_of_station(name: str) -> bool:
    return name.rpartition(".")[2] in STATION_DRIFT


def _confounded(told: TemperatureEvidence) -> str:
    name = max(told.narrow, key=lambda n: told.wide[n] / told.narrow[n])
    return (
        f"temperature and {_clock(told)} go together in these measurements (correlation {told.correlation:.2f}), so a change with "
        f"temperature is hardly told from another drift: it widens the interval of {name} by a factor of "
        f"{told.wide[name] / told.narrow[name]:.1f}; "
        "measure while the arm warms up and cools down, or with warm and cold poses mixed, to tell them apart"
    )


def _clock(told: TemperatureEvidence) -> str:
    return "time" if told.timed else "the order of measuring"
