"""Where a fleet's files are: a folder, or a bucket of which the files that matter are copied."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any

from flexcal.errors import InputError
from flexcal.jobs.recheck import VISITS
from flexcal.jobs.result_files import DESCRIPTIONS, RESULTS

ROBOT = "robot.yaml"
_WANTED = (ROBOT, RESULTS, VISITS, "estimates.npz")


@contextmanager
def local_fleet(place: str) -> Iterator[Path]:
    """The folder `place`; of an address with `://` a copy of its descriptions and results in a temporary folder, while it is needed.

    Raises `InputError` where there is no such folder, and where an address cannot be read.
    """
    if "://" not in place:
        folder = Path(place)
        if not folder.is_dir():
            raise InputError(
                "E-FLEET-001",
                f"{place} is no folder; name the folder that has the folders of the robots in it.",
            )
        yield folder
        return
    with TemporaryDirectory() as copy:
        folder = Path(copy) / (PurePosixPath(place).name.replace(":", "") or "fleet")
        folder.mkdir()
        _copy(place, folder)
        yield folder


def _copy(address: str, target: Path) -> None:
    try:
        from fsspec.core import url_to_fs
    except ImportError as problem:
        raise InputError(
            "E-FLEET-002", f"{address} needs fsspec to be read; install it: pip install 'flexcal[bucket]'."
        ) from problem
    try:
        system, root = url_to_fs(address)
        files = system.find(root, detail=True)
        for name, about in files.items():
            part = Path(os.path.relpath(name, root))
            if not _is_wanted(part) or ".." in part.parts or part.is_absolute():
                continue
            file = target / part
            file.parent.mkdir(parents=True, exist_ok=True)
            system.get_file(name, str(file))
            stamp = _modified(about)
            if stamp is not None:
                os.utime(file, (stamp, stamp))
    except Exception as problem:  # of whatever library serves this protocol
        reason = " ".join(str(problem).split()).rstrip(".") or type(problem).__name__
        raise InputError(
            "E-FLEET-003",
            f"{address} cannot be read ({reason}); check the address and the rights to it.",
        ) from problem
    if not files:
        raise InputError("E-FLEET-004", f"there are no files at {address}; check the address.")


def _is_wanted(part: Path) -> bool:
    return (
        not part.is_absolute()
        and ".." not in part.parts
        and not any(name.startswith(".") for name in part.parts)
        and (part.name in _WANTED or part.suffix in DESCRIPTIONS)
    )


def _modified(about: dict[str, Any]) -> float | None:
    """Seconds since 1970 of a file's last change, by whatever name its file system gives it."""
    for key in ("mtime", "LastModified", "last_modified", "updated", "created"):
        stamp = about.get(key)
        if isinstance(stamp, datetime):
            return stamp.timestamp()
        if isinstance(stamp, int | float):
            return float(stamp)
    return None
