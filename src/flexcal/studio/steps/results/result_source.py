"""What a result was computed from, and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Any

from flexcal.errors import FlexcalError
from flexcal.files.formats import read_estimates, sha256_of
from flexcal.jobs.result_files import ESTIMATES, RESULTS, read_results
from flexcal.report.sections import input_files

_TABLES = (".csv", ".parquet")


@dataclass(frozen=True)
class ResultSource:
    """The measured tables of a result, and when it was written.

    Parameters
    ----------
    kind : str
        Kind of the result, such as 'verification'.
    tables : mapping of str to str
        SHA-256 of the measured tables by their names; empty where they were not recorded.
    written : datetime
        When, local time.
    """

    kind: str
    tables: Mapping[str, str]
    written: datetime

    @classmethod
    def read(cls, folder: Path) -> ResultSource | None:
        """Source of the result in `folder`; None where there is no result that can be read."""
        files = (folder / RESULTS, folder / ESTIMATES)
        return _read(folder, tuple(path.stat().st_mtime_ns if path.is_file() else 0 for path in files))

    @property
    def names(self) -> str:
        """Names of the tables; 'other files' where they were not recorded."""
        return ", ".join(self.tables) or "other files"

    @property
    def stem(self) -> str:
        """Names of the tables without ending."""
        return ", ".join(PurePosixPath(name).stem for name in self.tables)

    @property
    def title(self) -> str:
        """What the result is, such as 'verification of others.csv, 26 Nov 09:12'."""
        of = f" of {self.names}" if self.tables else ""
        return f"{self.kind}{of}, {self.written.day} {self.written:%b %H:%M}"

    def is_of(self, file: Path) -> bool:
        """Whether `file` is one of the tables, with the content that was read."""
        try:
            return sha256_of(file) in self.tables.values()
        except (FlexcalError, OSError):
            return False

    def names_table(self, file: str) -> bool:
        """Whether one of the tables has the name of a file, in whatever folder."""
        return PurePosixPath(file).name in {PurePosixPath(name).name for name in self.tables}

    def difference(self, project: Path, chosen: str) -> str:
        """What distinguishes the chosen table, by its name in the folder `project`, from those of the result; empty where nothing does."""
        if not self.tables or self.is_of(project / chosen):
            return ""
        if self.names_table(chosen):
            return f"{chosen} has changed since the result below was computed."
        verb = "verified" if self.kind == "verification" else "used"
        return f"The result below is of {self.names}; {chosen} has not been {verb}."


@lru_cache(maxsize=16)
def _read(folder: Path, changed: tuple[int, ...]) -> ResultSource | None:
    """Source of a result; `changed` tells the versions of its files apart."""
    try:
        results = read_results(folder)
        written = datetime.fromtimestamp((folder / RESULTS).stat().st_mtime)
    except (FlexcalError, OSError):
        return None
    files = input_files(_provenance(folder, results))
    tables = {name: digest for name, digest in files.items() if name.endswith(_TABLES)}
    return ResultSource(str(results["kind"]), tables, written)


def _provenance(folder: Path, results: Mapping[str, Any]) -> Mapping[str, str]:
    """Provenance of a result, which calibrations have in their estimates."""
    if isinstance(results.get("provenance"), dict):
        return results["provenance"]
    try:
        blocks = read_estimates(folder / ESTIMATES)
    except (FlexcalError, OSError):
        return {}
    return blocks[results["kind"]].provenance if results["kind"] in blocks else {}
