"""The documents that scripts read (FORMATS: results.json), and the blocks they share."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.atomic import write_text
from flexcal.estimation import Dropped, Estimate, Identifiability, name_direction

RESULTS = "results.json"

_WEAK_DIRECTIONS = 3


def json_text(document: Mapping[str, Any]) -> str:
    """`document` as JSON; numbers that are not finite become null."""
    return json.dumps(_plain(document), indent=2, ensure_ascii=False, allow_nan=False)


def write_results(folder: Path, document: Mapping[str, Any]) -> None:
    """Leave `document` in `folder` as results.json, atomically."""
    write_text(folder / RESULTS, json_text(document) + "\n")


def quantities(estimate: Estimate, truth: Mapping[str, float] | None = None) -> dict[str, dict[str, Any]]:
    """Every parameter of an estimate as {estimate, std, low, high, truth, identifiable}, by name."""
    known = truth or {}
    return {name: estimate.quantity(name, known.get(name)) for name in estimate.parameters.names}


def dropped_parameters(dropped: Iterable[Dropped]) -> list[dict[str, Any]]:
    """The dropped parameters and what absorbed each: kept + coefficient · dropped is what the kept one estimates."""
    return [
        {"name": d.name, "absorbed_by": [{"name": name, "coefficient": c} for name, c in d.absorbed_by]}
        for d in dropped
    ]


def identifiability_block(found: Identifiability) -> dict[str, Any]:
    """Number of parameters, rank, dropped parameters, decades of the gap, and the weakest of the directions that are seen."""
    weakest = range(found.rank - 1, max(-1, found.rank - 1 - _WEAK_DIRECTIONS), -1)
    return {
        "parameters": len(found.names),
        "rank": found.rank,
        "gap_decades": found.gap,
        "dropped": dropped_parameters(found.dropped),
        "weak_directions": [
            {
                "relative_singular_value": float(found.singular_values[i]),
                "direction": name_direction(found.directions[i], found.names),
            }
            for i in weakest
        ],
    }


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value
