"""Expansion and drift with temperature, and what they cannot be told from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.calibration.verification import CALIBRATED, RIGID, MeasuredPoints
from flexcal.estimation import Estimate
from flexcal.report.figures import residual_growth
from flexcal.report.layout import NOTHING, Block, FigureBlock, Section, Table, scaled, significant


def temperature_section(told: Mapping[str, Any], estimate: Estimate, points: MeasuredPoints) -> Section:
    """Parameters of temperature with their intervals, and residuals against it; `told` is the block of results.json."""
    rows = []
    for name, stds in told["parameters"].items():
        factor, unit = scaled(estimate.parameters[name].unit)
        interval = estimate.interval(name)
        bounds = NOTHING if interval is None else " to ".join(significant(factor * v, 3) for v in interval)
        alone = significant(factor * stds["std_without_time"], 2)
        wide = significant(factor * stds["std"], 2)
        rows.append((name, unit, significant(factor * estimate.values[name], 3), bounds, wide, alone))
    clock = "time" if told["timed"] else "measuring order"
    table = Table(
        "table-temperature",
        "Parameters of temperature",
        ("parameter", "unit", "estimate", "95 % interval", "1σ", "1σ if nothing drifts with time"),
        tuple(rows),
        f"All other parameters hold at {told['reference']:.1f} °C. Correlation of temperature and {clock}: {told['correlation']:.2f}.",
        text_columns=(1,),
    )
    return Section(
        "temperature",
        "Temperature",
        f"The robot changes with temperature, measured from {told['lowest']:.1f} to {told['highest']:.1f} °C. The intervals include what "
        "may have changed with time instead, and the noise of the sensor where it is known.",
        (table, *_growth_figure(estimate, points)),
    )


def _growth_figure(estimate: Estimate, points: MeasuredPoints) -> tuple[Block, ...]:
    """Residuals away from the base before and after; none where what was measured is no point before an instrument."""
    poses, temperature = points.poses, points.poses.temperature
    bases = {name: [f"station.{name}.{key}" for key in "xyz"] for name in poses.stations}
    known = all(name in estimate.parameters for names in bases.values() for name in names)
    if temperature is None or not poses.located.all() or not known or RIGID not in points.errors:
        return ()
    base = np.array([[estimate.values[key] for key in bases[name]] for name in poses.station.tolist()])
    away = poses.position - base
    away = away / np.linalg.norm(away, axis=1)[:, None]
    labels = {RIGID: "without terms of temperature", CALIBRATED: "calibrated"}
    outward = {label: (points.errors[key] * away).sum(axis=1) for key, label in labels.items()}
    return (
        FigureBlock(
            "figure-growth",
            "Residuals away from the base against temperature",
            residual_growth(temperature, outward),
            "An arm that expands is longer than a model without expansion says where it is warm: the line slopes. With the terms of "
            "temperature it is level.",
            f"Residuals of {len(poses)} measurements in the direction away from the robot's base against temperature, before and after.",
        ),
    )
