"""Writing of `.npz` files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from flexcal.files.transaction import atomic_path


def write_npz(path: str | Path, arrays: Mapping[str, ArrayLike]) -> None:
    """Write named arrays into one compressed file, atomically."""
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
