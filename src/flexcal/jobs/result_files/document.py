"""Content of results.json: kinds, common blocks, writing and reading (docs/file-formats.md)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from flexcal.errors import InputError
from flexcal.estimation import Dropped, Estimate, Identifiability
from flexcal.files.formats import json_values, read_json
from flexcal.files.transaction import current_path, refuse_mixture, write_text

RESULTS = "results.json"

DESCRIPTIONS = (".yaml", ".yml", ".urdf", ".xml")
"""Endings of the inputs in a provenance that describe the robot; all others are measurements."""

AGAIN = "run the verb that writes it again"
"""Advice if a file of a run cannot be used."""

_ROUNDING = 1e-9
"""Size of a coefficient, in SI units, below which it counts as a rounding error of zero."""


Kind = Literal[
    "actuators",
    "calibration",
    "demo",
    "dynamics",
    "excitation",
    "frame",
    "gains",
    "inertials",
    "measurement",
    "payload",
    "recheck",
    "repeatability",
    "response",
    "stiffness",
    "study",
    "tool",
    "verification",
]
"""Kind of document in results.json."""
SCHEMA = 1
"""Schema version of results.json, incremented when a key changes its meaning or is removed."""


def header(kind: Kind) -> dict[str, Any]:
    """First entries of every results.json."""
    return {"kind": kind, "schema": SCHEMA}


@dataclass(frozen=True)
class RunRecord:
    """Provenance of a result: program, options, the SHA-256 of all files, and the command line, if any."""

    provenance: Mapping[str, str]
    command: str = ""

    def document(self) -> dict[str, Any]:
        """Last entries of a JSON document."""
        return {"provenance": dict(self.provenance), "command": self.command}


NOT_RECORDED = RunRecord({})
"""Provenance of a result that was not made from files."""


def json_text(document: Mapping[str, Any]) -> str:
    """Document as JSON text in ASCII; numbers that are not finite become null."""
    return json.dumps(json_values(document), indent=2, allow_nan=False)


def write_results(folder: Path, document: Mapping[str, Any]) -> None:
    """Write `document` to `folder` as results.json, atomically."""
    write_text(folder / RESULTS, json_text(document) + "\n")


def read_results(folder: Path) -> dict[str, Any]:
    """Document in `folder`; raises `InputError` if there is none, and for one of another schema."""
    path = folder / RESULTS
    if current_path(path) == path:  # else of the run that is at work
        refuse_mixture(folder)
    document = read_json(path, AGAIN)
    if not isinstance(document, dict):
        raise InputError("E-RUN-079", f"{path} holds no results of a verb; {AGAIN}.")
    if document.get("kind") not in get_args(Kind) or document.get("schema") != SCHEMA:
        raise InputError(
            "E-RUN-080", f"{path} is not of this version of flexcal (kind and schema {SCHEMA}); {AGAIN}."
        )
    return document


def quantities(estimate: Estimate, truth: Mapping[str, float] | None = None) -> dict[str, dict[str, Any]]:
    """Every parameter of an estimate as {estimate, std, low, high, truth, identifiable}, by name."""
    known = truth or {}
    return {name: estimate.quantity(name, known.get(name)) for name in estimate.parameters.names}


def dropped_parameters(dropped: Iterable[Dropped]) -> list[dict[str, Any]]:
    """Dropped parameters and those that absorbed each: kept + coefficient · dropped is what the kept one estimates."""
    return [
        {
            "name": d.name,
            "absorbed_by": [{"name": n, "coefficient": c} for n, c in d.absorbed_by if abs(c) > _ROUNDING],
        }
        for d in dropped
    ]


def identifiability_block(identifiability: Identifiability) -> dict[str, Any]:
    """Number of parameters, rank, dropped parameters, decades of the gap, and the weakest of the determined directions."""
    return {
        "parameters": len(identifiability.names),
        "rank": identifiability.rank,
        "gap_decades": identifiability.gap,
        "dropped": dropped_parameters(identifiability.dropped),
        "weak_directions": [
            {"relative_singular_value": value, "direction": direction}
            for direction, value in identifiability.weak_seen_directions()
        ],
    }


def identifiability_spectrum(identifiability: Identifiability) -> dict[str, Any]:
    """Kept parameters, and singular values and diagonal of R relative to the largest, as plotted in a figure of the rank."""
    return {
        "kept": list(identifiability.kept_names),
        "singular_values": identifiability.singular_values,
        "diagonal": identifiability.diagonal,
    }


def springs_block(estimate: Estimate, truth: Mapping[str, float] | None = None) -> dict[str, Any]:
    """{stiffness, damping} of every spring as quantities, by joint and drive, bearing_x or bearing_y."""
    springs: dict[str, Any] = {"stiffness": {}, "damping": {}}
    for name in estimate.parameters.names:
        owner, _, kind = name.rpartition(".")
        joint, _, spring = owner.rpartition(".")
        if kind in springs and joint:
            springs[kind].setdefault(joint, {})[spring] = estimate.quantity(name, (truth or {}).get(name))
    return springs
