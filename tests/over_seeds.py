"""Statistical tests over many seeds, in the processes that are free."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterable
from types import FunctionType
from typing import Any, TypeVar

from cloudpickle import register_pickle_by_value

from flexcal.parallel import open_workers

V = TypeVar("V")


def over_seeds(function: Callable[..., V], seeds: Iterable[Any], *common: Any) -> list[V]:
    """`function(seed, *common)` of every seed, in their order, by the workers that the product has for its own tasks.

    The function is one of a test module and depends on its arguments alone; what it writes is below a folder of its seed. As in other
    tests a RuntimeWarning is an error, and the first error ends the test.
    """
    for value in (function, *common):
        if isinstance(value, FunctionType):  # workers import neither test modules nor conftest.py
            register_pickle_by_value(sys.modules[value.__module__])
    with open_workers(None, _processes()) as workers:
        return list(workers.values(_strictly, seeds, function, *common))


def _strictly(seed: Any, function: Callable[..., V], *common: Any) -> V:
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        return function(seed, *common)


def _processes() -> int:
    """Share of the processors that is left to each of the processes that run tests."""
    return max(1, (os.cpu_count() or 1) // int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))
