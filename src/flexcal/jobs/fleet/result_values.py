"""Numbers of a results.json that a fleet's table has, in SI units, with the uncertainty of errors from their number."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from flexcal.jobs.recheck import Visit
from flexcal.units import MILLIMETRE

_MEAN, _NINETIETH = 0.73, 0.95
"""Relative standard deviations of the mean and of the 90th percentile of distances, times the root of the degrees of freedom: of errors
with a normal distribution, alike in all directions, whose distances have Maxwell's distribution."""


@dataclass(frozen=True)
class ResultValue:
    """A number by its name, with its standard deviation where that is known, and words that belong to it."""

    name: str
    value: float | None
    std: float | None
    unit: str
    text: str | None = None


def result_values(document: Mapping[str, Any]) -> list[ResultValue]:
    """Numbers of a results.json; none of a kind that says nothing of a robot over time. Raises `KeyError` where one is missing."""
    reader = _READERS.get(document["kind"])
    if reader is None:
        return []
    trusted = (document.get("verdict") or {}).get("trusted")
    return [*reader(document), ResultValue("trusted", None if trusted is None else float(trusted), None, "1")]


def visit_values(visit: Visit) -> list[ResultValue]:
    """Verdict of a visit of a recheck as `text`, probability that a robot as calibrated looks so, alarms of its cumulative sums, and shifts
    of every joint as if it alone had shifted.
    """
    changed = visit.verdict != "as_calibrated"
    return [
        ResultValue("changed", float(changed), None, "1", visit.sentence),
        ResultValue("probability", visit.probability, None, "1", visit.verdict),
        ResultValue("alarms", float(len(visit.alarms)), None, "1", " ".join(visit.alarms)),
        *(
            ResultValue(f"shift.{item.subject}", item.estimate, math.hypot(item.std, item.common_std), "")
            for item in visit.shifts
        ),
    ]


def _verification(document: Mapping[str, Any]) -> list[ResultValue]:
    measured = document["verification"]["measured"]
    freedom = 3.0 * measured["poses"]
    if (prediction := document["prediction"]) is not None:
        freedom = min(freedom, float(prediction["freedom"] or freedom))
    values = _errors(measured, freedom)
    rms = document["rms_mm"]
    values += [
        _length("error.rms", rms["measured"], 1 / math.sqrt(2 * freedom)),
        _length("error.expected_rms", rms["expected"]),
    ]
    moved = document["refit_proposed"]
    what = "" if moved is None else " and ".join(moved["what"])
    values.append(ResultValue("moved", float(moved is not None), None, "1", what))
    if (warm := document.get("temperature")) is not None and warm["outside"] is not None:
        values.append(ResultValue("temperature.outside", warm["outside"], None, "K"))
        values.append(_length("error.growth", warm["growth_mm"]))
    own = document["before"]["own"] or document["before"]["registered"]
    if own is not None:
        values.append(_length("uncalibrated.p90", own["p90_mm"]))
    return values


def _calibration(document: Mapping[str, Any]) -> list[ResultValue]:
    values = _errors(document["calibration"]["selected"], None)
    if (crossed := document["cross_validation"]) is not None:
        values.append(_length("left_out.mean", crossed["mean_mm"]))
    return values


def _repeatability(document: Mapping[str, Any]) -> list[ResultValue]:
    values = [_number("poses", document["poses"]), _number("visits", document["visits"]["total"])]
    for key in ("rp_mm", "ap_nominal_mm", "ap_calibrated_mm"):
        if (spread := document.get(key)) is not None:
            values += [_length(f"{key.removesuffix('_mm')}.{what}", spread[what]) for what in ("mean", "max")]
    return values


def _dynamics(document: Mapping[str, Any]) -> list[ResultValue]:
    """Torque errors of identified logs, relative: in the fit, and outside it where there is something."""
    percent = document["error_percent"]
    values = [("torque_error.fit", percent["train"]), ("torque_error.held_out", percent["held_out"])]
    return [_number(name, value / 100) for name, value in values if value is not None]


def _stiffness(document: Mapping[str, Any]) -> list[ResultValue]:
    """Reduced chi-square of the responses; null where the measurements do not give their noise."""
    return [
        ResultValue("reduced_chi2", document["fit"]["reduced_chi2"], None, "1", document["fit"]["status"])
    ]


_READERS: dict[str, Callable[[Mapping[str, Any]], list[ResultValue]]] = {
    "calibration": _calibration,
    "dynamics": _dynamics,
    "repeatability": _repeatability,
    "stiffness": _stiffness,
    "verification": _verification,
}


def _errors(block: Mapping[str, Any], freedom: float | None) -> list[ResultValue]:
    """Mean, 90th percentile and maximum of distances; with their uncertainty where their degrees of freedom are known."""
    root = None if freedom is None else math.sqrt(freedom)
    return [
        _number("poses", block["poses"]),
        _length("error.mean", block["mean_mm"], None if root is None else _MEAN / root),
        _length("error.p90", block["p90_mm"], None if root is None else _NINETIETH / root),
        _length("error.max", block["max_mm"]),
    ]


def _length(name: str, millimetres: float | None, relative: float | None = None) -> ResultValue:
    value = None if millimetres is None else MILLIMETRE * float(millimetres)
    return ResultValue(name, value, None if value is None or relative is None else relative * value, "m")


def _number(name: str, value: float) -> ResultValue:
    return ResultValue(name, float(value), None, "1")
