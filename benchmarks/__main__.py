"""`python -m benchmarks [name …]`: run the named benchmarks, or all of them, and print a table of ratios."""

from __future__ import annotations

import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # single thread unless a benchmark says otherwise

import importlib
import pkgutil
from pathlib import Path

from benchmarks.peers import PeerAbsentError

SLOW = ("guided_measuring", "hard_cell", "kill", "mismatch", "trajectories", "two_stage_seeds")
"""Asked for by name only: they take hours."""


def main(names: list[str]) -> int:
    """Run and print; a benchmark whose peer cannot be installed is skipped with the reason. Returns the exit status."""
    modules = pkgutil.iter_modules([str(Path(__file__).parent)])
    found = sorted(m.name for m in modules if not m.name.startswith("_") and not m.ispkg)
    unknown = [name for name in names if name not in found]
    if unknown:
        print(f"there is no benchmark '{unknown[0]}'; there are {', '.join(found)}.", file=sys.stderr)
        return 2
    print(f"{'benchmark':24s} {'what':60s} {'ratio':>10s}   measured")
    for name in names or [n for n in found if n not in SLOW]:
        try:
            for label, ratio, note in importlib.import_module(f"benchmarks.{name}").run():
                print(f"{name:24s} {label:60s} {ratio:10.1f}   {note}", flush=True)
        except PeerAbsentError as problem:
            print(f"{name:24s} skipped: {problem}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
