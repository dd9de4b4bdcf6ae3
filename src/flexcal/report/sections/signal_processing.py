"""Filtering and decimation of joint logs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.layout import Table, significant


def signals_table(signals: Mapping[str, Any]) -> Table:
    """Cut-off and decimation, who chose them, and the treatment of irregular time stamps, from `signals` of results.json."""

    def origin(key: str) -> str:
        return "chosen by flexcal" if key in signals["proposed"] else "robot.yaml"

    rows = (
        ("low-pass cut-off of the positions / Hz", significant(signals["cutoff_hz"]), origin("cutoff_hz")),
        ("decimation: samples to one row", str(signals["decimation"]), origin("decimation")),
        *(
            (f"time stamps of {log}", words, "the log")
            for log, words in signals.get("time_stamps", {}).items()
        ),
    )
    return Table("table-signals", "Signals used", ("what", "value", "from"), rows, text_columns=(1, 2))
