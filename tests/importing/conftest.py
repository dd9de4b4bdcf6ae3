"""Foreign tables of the UR5, made by the tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flexcal.data.tables import Table, TableFile
from flexcal.importing.tables import ForeignTable

MakeTable = Callable[..., ForeignTable]


@pytest.fixture
def made() -> MakeTable:
    """A foreign table of named columns (N,)."""

    def make(
        columns: dict[str, np.ndarray], units: dict[str, str] | None = None, *, named: bool = True
    ) -> ForeignTable:
        return ForeignTable(
            Table(TableFile(Path("foreign.csv"), tuple(columns), 2), 2, columns), units or {}, named
        )

    return make
