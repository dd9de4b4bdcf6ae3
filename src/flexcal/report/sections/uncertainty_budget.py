"""The uncertainty budget of a measured point: instrument, robot and model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flexcal.report.layout import NOTHING, Table, document_millimetres, p_value

_OTHERS = {
    "views_mm": "views of a camera, beside what is stated of them",
    "sockets_mm": "ball in its socket",
    "lengths_mm": "lengths of wires, beside what is stated of them",
    "contacts_mm": "contacts, beside what is stated of them",
}


def noise_tables(stated_noise: Sequence[Mapping[str, Any]]) -> tuple[Table, ...]:
    """Test of the stated noise of all instruments, and of each; empty where none is stated. `stated_noise` is that of results.json."""
    if not stated_noise:
        return ()
    rows = [
        (
            item["instrument"] or "all together",
            str(item["readings"]),
            f"{item['reduced_chi2'] ** 0.5:.2f}",
            f"{item['reduced_chi2']:.2f}",
            p_value(item["p"]),
        )
        for item in stated_noise
    ]
    return (
        Table(
            "table-stated-noise",
            "Is the noise as stated?",
            ("instrument", "coordinates", "scatter / stated sigma", "χ² per degree of freedom", "p"),
            tuple(rows),
            note="Against the stated sigma alone: one where it is all the noise that there is. A robot that repeats less well than its "
            "instrument measures has more; weights and intervals are not those of the stated sigma but of the table above.",
        ),
    )


def budget_table(variances: Mapping[str, float | None], instrument_name: str = "instrument") -> Table:
    """The three standard deviations of a coordinate and their sum; `variances` is that of results.json."""
    instrument, robot, model = (variances[key] for key in ("instrument_mm", "robot_mm", "model_mm"))
    whole = float(np.sqrt(sum((value or 0.0) ** 2 for value in (instrument, robot, model))))

    def share(value: float | None) -> str:
        return NOTHING if value is None or whole == 0 else f"{100 * (value / whole) ** 2:.0f} %"

    stated = variances["stated_mm"]
    said = "not stated: in the robot's" if stated is None else f"stated as {document_millimetres(stated)} mm"
    rows = (
        (f"{instrument_name} ({said})", document_millimetres(instrument), share(instrument)),
        ("robot: repeatability", document_millimetres(robot), share(robot)),
        ("model: systematic errors common to neighbouring poses", document_millimetres(model), share(model)),
        ("sum of the variances", document_millimetres(whole), share(whole)),
    )
    other = [
        (text, document_millimetres(variances[key]), NOTHING)
        for key, text in _OTHERS.items()
        if variances.get(key) is not None
    ]
    rows = (*rows, *other)
    return Table(
        "table-budget",
        "Uncertainty budget of a measured coordinate",
        ("source", "1σ / mm", "share of the variance"),
        rows,
        strong=(len(rows) - 1 - len(other),),
        note="Estimated from the residuals by restricted maximum likelihood. Intervals and predictions include all three.",
    )
