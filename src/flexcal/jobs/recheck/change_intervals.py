"""Sizes of a change with their intervals, for JSON documents."""

from __future__ import annotations

from typing import Any

from flexcal.calibration.recheck import Suspect, VisitCourse


def change_intervals(found: Suspect | VisitCourse) -> dict[str, dict[str, Any]]:
    """Block `changes` of a change at a visit or over visits: every quantity's estimate, standard deviation and interval."""
    change = found.change
    return {
        name: {
            "estimate": float(value),
            "std": float(std),
            "low": float(value - found.quantile * std),
            "high": float(value + found.quantile * std),
            "unit": unit,
        }
        for name, unit, value, std in zip(change.names, change.units, found.estimate, found.std, strict=True)
    }
