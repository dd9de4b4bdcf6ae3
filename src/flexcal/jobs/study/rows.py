"""Rows of a study: what each task is given."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.jobs.study.config import ChoiceConfig, DrawConfig, LogUniformConfig, StudyConfig, UniformConfig


@dataclass(frozen=True)
class StudyRow:
    """One task: values of options by name, the seed, and which data it takes (`resample`, empty where all or none)."""

    options: Mapping[str, Any]
    seed: int
    resample: str = ""

    @property
    def key(self) -> str:
        """Name of the task, which depends on nothing but what it is given."""
        given = json.dumps([dict(sorted(self.options.items())), self.seed, self.resample])
        return hashlib.sha256(given.encode()).hexdigest()[:20]


def combination_count(config: StudyConfig) -> int:
    """Number of `combinations`."""
    return math.prod(map(len, config.grid.values())) * (1 if config.draw is None else config.draw.count)


def combinations(config: StudyConfig) -> Iterator[dict[str, Any]]:
    """Values of options by name: every combination of the grid with every draw."""
    names, values = list(config.grid), list(config.grid.values())
    for drawn in _draws(config.draw):
        for chosen in itertools.product(*values):
            yield {**config.options, **drawn, **dict(zip(names, chosen, strict=True))}


def rows(
    chosen: Sequence[Mapping[str, Any]], seeds: Sequence[int], resamples: Sequence[str]
) -> list[StudyRow]:
    """A row for every combination of options, seed and resample."""
    return [StudyRow(options, seed, part) for options in chosen for seed in seeds for part in resamples]


def _draws(config: DrawConfig | None) -> Iterator[dict[str, Any]]:
    if config is None:
        yield {}
        return
    for number in range(config.count):
        rng = np.random.default_rng([config.seed, number])  # the first draws stay when the count grows
        yield {name: _drawn(how, rng) for name, how in config.options.items()}


def _drawn(how: UniformConfig | LogUniformConfig | ChoiceConfig, rng: np.random.Generator) -> Any:
    if isinstance(how, UniformConfig):
        return float(rng.uniform(*how.uniform))
    if isinstance(how, LogUniformConfig):
        return float(np.exp(rng.uniform(*np.log(how.log_uniform))))
    return how.choice[int(rng.integers(len(how.choice)))]
