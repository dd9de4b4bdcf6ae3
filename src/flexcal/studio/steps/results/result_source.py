"""What a result was computed from, and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Any

from flexcal.errors import FlexcalError
from flexcal.files.formats import read_estimates, sha256_of
from flexcal.jobs.result_files import RESULTS, read_results

_INPUT = "input."
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
        try:
            results = read_results(folder)
            written = datetime.fromtimestamp((folder / RESULTS).stat().st_mtime)
        except (FlexcalError, OSError):
            return None
        inputs = _provenance(folder, results)
        tables = {
            key.removeprefix(_INPUT): digest
            for key, digest in inputs.items()
            if key.startswith(_INPUT) and key.endswith(_TABLES)
        }
        return cls(str(results["kind"]), tables, written)

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

    def difference(self, project: Path, chosen: str) -> str:
        """What distinguishes the chosen table, by its name in the folder `project`, from those of the result; empty where nothing does."""
        if not self.tables or self.is_of(project / chosen):
            return ""
        if PurePosixPath(chosen).name in {PurePosixPath(name).name for name in self.tables}:
            return f"{chosen} has changed since the result below was computed."
        verb = "verified" if self.kind == "verification" else "used"
        return f"The result below is of {self.names}; {chosen} has not been {verb}."


def _provenance(folder: Path, results: Mapping[str, Any]) -> Mapping[str, str]:
    """Provenance of a result, which calibrations have in their estimates."""
    if isinstance(results.get("provenance"), dict):
        return results["provenance"]
    try:
        blocks = read_estimates(folder / "estimates.yaml")
    except (FlexcalError, OSError):
        return {}
    return blocks[results["kind"]].provenance if results["kind"] in blocks else {}
