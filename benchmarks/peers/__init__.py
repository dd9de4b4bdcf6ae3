"""Peers run in environments of their own, as subprocesses that answer in JSON."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ENVIRONMENTS = HERE.parent.parent / "build" / "peers"


class PeerAbsentError(Exception):
    """A peer cannot be installed here; the message says why."""


def run_peer(script: str, requirements: tuple[str, ...], payload: dict[str, Any]) -> dict[str, Any]:
    """Run `script` (in this folder) with `payload` on standard input in an environment holding `requirements`, single-threaded.

    Raises `PeerAbsentError` where the environment cannot be made.
    """
    home = ENVIRONMENTS / script.removesuffix(".py")
    python = home / "bin" / "python"
    if not (home / ".installed").exists():
        _install([sys.executable, "-m", "venv", str(home)], script)
        _install([str(python), "-m", "pip", "install", "--quiet", *requirements], " ".join(requirements))
        (home / ".installed").touch()
    threads = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    done = subprocess.run(
        [str(python), str(HERE / script)],
        input=json.dumps(payload),
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **threads},
    )
    return json.loads(done.stdout.splitlines()[-1])


def _install(command: list[str], what: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        reason = (done.stderr or done.stdout).strip().splitlines()
        raise PeerAbsentError(
            f"{what} cannot be installed ({reason[-1] if reason else 'no reason is given'})."
        )
