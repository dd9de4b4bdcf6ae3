"""Time stamps in text form in tables of other programs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.data.table import Table
from flexcal.data.timestamps import seconds_of
from flexcal.importing.foreign_table import ForeignTable


def with_times(foreign: ForeignTable) -> ForeignTable:
    """`foreign` with texts most of which are timestamps as seconds from the first of their column, named in `times`."""
    found = {}
    for name, texts in foreign.texts.items():
        seconds = seconds_of(texts.tolist())
        if seconds is not None:
            found[name] = seconds
    if not found:
        return foreign
    notes = [
        f"{name} counts in seconds from {foreign.texts[name][np.isfinite(seconds)][0]}"
        for name, seconds in found.items()
    ]
    table = Table(foreign.table.file, foreign.table.first, {**foreign.table.columns, **found})
    return replace(foreign, table=table, notes=(*foreign.notes, *notes), times=(*foreign.times, *found))
