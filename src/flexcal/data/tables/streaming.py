"""Table written part by part."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from flexcal.files.transaction import atomic_path


@contextmanager
def streamed_table(path: Path) -> Iterator[Callable[[Mapping[str, np.ndarray]], None]]:
    """Table at `path`, CSV or Parquet by its suffix, to which tables of the same columns are appended within the block.

    It is there after the block, all of it or nothing. Until then the parts are files beside it, and only one is in memory.
    """
    import polars as pl

    with atomic_path(path) as temporary, TemporaryDirectory(dir=temporary.parent) as name:
        parts: list[Path] = []

        def append(columns: Mapping[str, np.ndarray]) -> None:
            parts.append(Path(name, f"{len(parts):08d}.parquet"))
            pl.DataFrame(dict(columns)).write_parquet(parts[-1])

        yield append
        whole = pl.scan_parquet(parts)
        if path.suffix == ".csv":
            whole.sink_csv(temporary)
        else:
            whole.sink_parquet(temporary)
