"""`python -m benchmarks [name …]`: run the named benchmarks, or all of them, and print a table of ratios."""

from __future__ import annotations

import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # single thread unless a benchmark says otherwise

import importlib
import pkgutil
from pathlib import Path

SLOW = ("mismatch", "two_stage_seeds")
"""Asked for by name only: they run the demonstration on many hidden truths."""


def main(names: list[str]) -> None:
    """Run and print."""
    found = sorted(
        m.name
        for m in pkgutil.iter_modules([str(Path(__file__).parent)])
        if not m.name.startswith("_") and not m.ispkg
    )
    for name in names or [n for n in found if n not in SLOW]:
        module = importlib.import_module(f"benchmarks.{name}")
        for label, ratio, note in module.run():
            print(f"{name:24s} {label:60s} {ratio:10.1f}   {note}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
