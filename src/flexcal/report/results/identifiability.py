"""Identifiable and dropped parameters of a calibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.estimation import Dropped


@dataclass(frozen=True, eq=False)
class IdentifiableParameters:
    """Identifiable ones out of a number of `parameters`.

    `singular_values` and `diagonal` (of R) are relative to the largest; `gap` in decades; `weak` names the weakest directions that are
    kept, each with its singular value.
    """

    parameters: int
    rank: int
    gap: float
    singular_values: np.ndarray
    diagonal: np.ndarray
    dropped: tuple[Dropped, ...]
    weak: tuple[tuple[str, float], ...]

    @classmethod
    def stored(cls, block: Mapping[str, Any]) -> IdentifiableParameters:
        """Parameters read from the block of results.json."""
        dropped = tuple(
            Dropped(item["name"], tuple((by["name"], by["coefficient"]) for by in item["absorbed_by"]))
            for item in block["dropped"]
        )
        weak = tuple(
            (item["direction"], item["relative_singular_value"]) for item in block["weak_directions"]
        )
        gap = np.inf if block["gap_decades"] is None else block["gap_decades"]
        values, diagonal = (np.array(block[key]) for key in ("singular_values", "diagonal"))
        return cls(block["parameters"], block["rank"], gap, values, diagonal, dropped, weak)
