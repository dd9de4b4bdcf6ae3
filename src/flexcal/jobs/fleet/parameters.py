"""Parameters of a fleet: which can be compared between robots and visits, their spread, and robots that stand out."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.files.formats import BLOCKS
from flexcal.fleet import Outlying, RandomEffects, outlying, random_effects
from flexcal.jobs.fleet.courses import Record, latest
from flexcal.jobs.fleet_prior import comparable_terms

_LARGEST_PRIOR_SHARE = 0.1
"""Largest share of a prior in a value: a larger one makes robots alike that are not."""
_FEWEST_ROBOTS = 3
"""Least number of robots of a model over which a parameter has a spread."""


@dataclass(frozen=True, eq=False)
class ParameterSpread:
    """A parameter over robots of a model: latest values (N,) with standard deviations (N,), `outliers` numbered as `robots`, and the
    distribution over the others.
    """

    model: str
    urdf: str
    kind: str
    name: str
    unit: str
    absorbs: str
    terms: tuple[str, ...]
    robots: tuple[str, ...]
    values: np.ndarray
    std: np.ndarray
    distribution: RandomEffects
    outliers: tuple[Outlying, ...]


def comparable(records: Sequence[Record]) -> list[Record]:
    """Records of parameters of robots: of the robot itself, and determined by measurements."""
    return [
        r
        for r in records
        if r["kind"] in BLOCKS
        and r["identifiable"]
        and r["value"] is not None
        and r["std"]
        and math.isfinite(r["std"])
        and (r["prior_share"] or 0.0) <= _LARGEST_PRIOR_SHARE
        and r["of_robot"]
    ]


def parameter_spreads(records: Sequence[Record], level: float) -> list[ParameterSpread]:
    """Spread of every parameter that three robots of a model or more have; `level`: probability that any robot of a model is named without
    being different.
    """
    robots: dict[tuple, dict[str, list[Record]]] = defaultdict(lambda: defaultdict(list))
    for r in records:
        key = (
            r["model"],
            r["urdf"],
            r["kind"],
            r["name"],
            r["unit"],
            r["absorbs"],
            comparable_terms(r["terms"]),
        )
        robots[key][r["robot"]].append(r)
    many = {key: group for key, group in robots.items() if len(group) >= _FEWEST_ROBOTS}
    tests: dict[tuple[str, str], int] = defaultdict(int)
    for model, urdf, *_ in many:
        tests[model, urdf] += 1
    spreads = []
    for key, group in many.items():
        last = [latest(group[name]) for name in sorted(group)]
        values, std = (np.array([r[column] for r in last]) for column in ("value", "std"))
        found = outlying(values, std, tests[key[0], key[1]], level)
        others = np.delete(np.arange(len(values)), [item.number for item in found])
        model, urdf, kind, name, unit, absorbs, terms = key
        spreads.append(
            ParameterSpread(
                model,
                urdf,
                kind,
                name,
                unit,
                absorbs,
                terms,
                tuple(r["robot"] for r in last),
                values,
                std,
                random_effects(values[others], std[others]),
                found,
            )
        )
    return spreads
