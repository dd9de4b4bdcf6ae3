"""The command line in this process, and copies of the examples that a test may write to."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from cli_files import copied

from flexcal.cli.main import main


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


Run = Callable[..., Outcome]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run `flexcal` with some arguments in this process."""

    def call(*arguments: str | Path) -> Outcome:
        capsys.readouterr()
        status = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
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
