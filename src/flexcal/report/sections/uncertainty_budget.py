"""The uncertainty budget of a measured point: instrument, robot and model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexcal.report.layout import NOTHING, Table, document_millimetres


def budget_table(variances: Mapping[str, float | None]) -> Table:
    """The three standard deviations of a coordinate and their sum; `variances` is that of results.json."""
    instrument, robot, model = (variances[key] for key in ("instrument_mm", "robot_mm", "model_mm"))
    whole = float(np.sqrt(sum((value or 0.0) ** 2 for value in (instrument, robot, model))))

    def share(value: float | None) -> str:
        return NOTHING if value is None or whole == 0 else f"{100 * (value / whole) ** 2:.0f} %"

    stated = variances["stated_mm"]
    said = "not stated: in the robot's" if stated is None else f"stated as {document_millimetres(stated)} mm"
    rows = (
        (f"instrument ({said})", document_millimetres(instrument), share(instrument)),
        ("robot: repeatability", document_millimetres(robot), share(robot)),
        ("model: systematic errors common to neighbouring poses", document_millimetres(model), share(model)),
        ("sum of the variances", document_millimetres(whole), share(whole)),
    )
    return Table(
        "table-budget",
        "Uncertainty budget of a measured coordinate",
        ("source", "1σ / mm", "share of the variance"),
        rows,
        strong=(len(rows) - 1,),
        note="Estimated from the points by restricted maximum likelihood. Intervals and predictions include all three.",
    )
