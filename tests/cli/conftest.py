"""The command line in this process, and copies of the examples that a test may write to.

A verb that opens a file which it is about to replace, instead of the new one that waits for its place, fails its test.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from cli_files import copied

from flexcal.cli.main import main
from flexcal.errors import FlexcalError
from flexcal.files.transaction import current_path


@dataclass(frozen=True)
class Outcome:
    """What a command line left: exit status, standard output, standard error."""

    status: int
    out: str
    err: str

    @property
    def document(self) -> dict[str, Any]:
        """Standard output as one JSON document."""
        return json.loads(self.out)


_stale: list[str] = []
"""Files that were opened although a newer one waits for their place."""


def _watch(event: str, arguments: tuple[Any, ...]) -> None:
    path = arguments[0] if event == "open" else None
    if isinstance(path, str | Path) and waits(Path(path)):
        _stale.append(str(path))


def waits(path: Path) -> bool:
    """Whether a newer file waits for this place, other than where the one in its place is meant."""
    try:
        return current_path(path) != path
    except (FlexcalError, OSError, ValueError):
        return False


sys.addaudithook(_watch)

Run = Callable[..., Outcome]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run `flexcal` with some arguments in this process."""

    def call(*arguments: str | Path) -> Outcome:
        capsys.readouterr()
        _stale.clear()
        status = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        assert _stale == []
        return Outcome(status, captured.out, captured.err)

    return call


@pytest.fixture
def ur5_folder(examples: Path, tmp_path: Path) -> Path:
    """A copy of the UR5 example."""
    return copied(examples / "ur5_tracker", tmp_path / "ur5")


@pytest.fixture
def tx90l_folder(examples: Path, tmp_path: Path) -> Path:
    """A copy of the TX90L example."""
    return copied(examples / "tx90l", tmp_path / "tx90l")
