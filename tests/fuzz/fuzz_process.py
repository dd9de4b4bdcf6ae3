"""A command line of flexcal on broken files: how it ended, and whether that is what it promises."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


@dataclass(frozen=True)
class Ending:
    """Exit status (negative: the signal that ended it), whether time ran out, both outputs, and the seconds it took."""

    status: int
    late: bool
    out: str
    err: str
    seconds: float

    def fault(self, files: Sequence[str]) -> str | None:
        """What is wrong with this ending, None where nothing is; `files` are the names one of which a refusal has to mention."""
        if self.late:
            return f"no end after {self.seconds:.0f} s"
        if self.status < 0:
            return f"ended by signal {-self.status}\n{self.err[-3000:]}"
        if "Traceback (most recent call last)" in self.err or self.status not in (0, 2):
            return f"exit status {self.status}\n{self.err[-4000:]}"
        if _CONTROL.search(self.out) or _CONTROL.search(self.err):
            return f"control characters reach the terminal: {_CONTROL.findall(self.out + self.err)[:5]}\n{(self.out + self.err)[-500:]!r}"
        others = [line for line in self.err.splitlines() if not line.endswith(" …")]
        if self.status == 0:
            return f"a warning of a library\n{self.err[-3000:]}" if "Warning: " in self.err else None
        if len(others) != 1 or not others[0].startswith("flexcal: "):
            return f"not one sentence\n{self.err[-3000:]}"
        if len(others[0]) > 1200:
            return f"a sentence of {len(others[0])} letters: {others[0][:300]} …"
        if not any(name in others[0] for name in files):
            return f"no file is named: {others[0]}"
        return None


class FlexcalProcesses:
    """Runs command lines, one forked process each; a context manager."""

    def __enter__(self) -> FlexcalProcesses:
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "POLARS_MAX_THREADS": "1", "PYTHONUTF8": "1"}
        program = Path(__file__).with_name("fuzz_worker.py")
        pipe = subprocess.PIPE
        self._worker = subprocess.Popen(
            [sys.executable, program],
            stdin=pipe,
            stdout=pipe,
            text=True,
            env=environment,
        )
        return self

    def __exit__(self, *_: object) -> None:
        assert self._worker.stdin is not None
        self._worker.stdin.close()
        self._worker.wait()

    def run(self, arguments: Sequence[str], folder: Path) -> Ending:
        """How `flexcal` with these arguments ends in `folder`."""
        assert self._worker.stdin is not None and self._worker.stdout is not None
        request = {"arguments": list(arguments), "folder": os.fspath(folder)}
        self._worker.stdin.write(json.dumps(request) + "\n")
        self._worker.stdin.flush()
        return Ending(**json.loads(self._worker.stdout.readline()))
