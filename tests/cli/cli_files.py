"""Files that the tests of the command line read, alter and compare."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

FLEXCAL = Path(sys.executable).parent / "flexcal"


def copied(source: Path, target: Path) -> Path:
    """A copy of an example, without estimates that somebody left there."""
    return Path(shutil.copytree(source, target, ignore=shutil.ignore_patterns("estimates.*", "__pycache__")))


def snapshot(folder: Path) -> dict[str, bytes]:
    """Every file below a folder with its content."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def read_csv(path: Path) -> tuple[list[str], np.ndarray]:
    """Header and rows (N, columns) of a table of numbers."""
    header = path.read_text().splitlines()[0].split(",")
    return header, np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)


def write_csv(path: Path, header: Sequence[str], rows: np.ndarray) -> Path:
    """Write a table of numbers; a column named pose holds whole numbers."""
    lines = [",".join(header)]
    for row in rows:
        lines.append(
            ",".join(
                f"{v:.0f}" if name == "pose" else repr(float(v)) for name, v in zip(header, row, strict=True)
            )
        )
    path.write_text("\n".join(lines) + "\n")
    return path
