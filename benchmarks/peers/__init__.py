"""Peers run in environments of their own, as subprocesses that answer in JSON."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

HERE = Path(__file__).parent
ENVIRONMENTS = HERE.parent.parent / "build" / "peers"


class PeerAbsentError(Exception):
    """A peer cannot be installed here; the message says why."""


def run_peer(
    script: str, requirements: tuple[str, ...], payload: dict[str, Any], *, compiled: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Run `script` (in this folder) with `payload` on standard input in its `environment`, single-threaded.

    Raises `PeerAbsentError` where that cannot be made.
    """
    python = environment(script, requirements, compiled=compiled) / "bin" / "python"
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


def environment(script: str, requirements: tuple[str, ...], *, compiled: tuple[str, ...] = ()) -> Path:
    """The folder of an environment of `script` that holds `requirements`, made where it is absent.

    `compiled` are installed after them, as they may need Ipopt's headers and library, which casadi's wheel holds. Raises
    `PeerAbsentError` where the environment cannot be made.
    """
    home = ENVIRONMENTS / script.removesuffix(".py")
    if (home / ".installed").exists():
        return home
    pip = [sys.executable, "-m", "pip", "--python", str(home), "install", "--quiet"]
    _install([sys.executable, "-m", "venv", "--without-pip", str(home)], script)
    _install([*pip, *requirements], " ".join(requirements))
    casadi = next(home.glob("lib/python*/site-packages")) / "casadi"
    headers, libraries = casadi / "include" / "coin-or", f"-L{casadi} -Wl,-rpath,{casadi}"
    ipopt = {"PKG_CONFIG_PATH": str(casadi / "pkgconfig"), "CFLAGS": f"-I{headers}", "LDFLAGS": libraries}
    for requirement in compiled:
        _install([*pip, requirement], requirement, ipopt)
    (home / ".installed").touch()
    return home


def _install(command: list[str], what: str, variables: Mapping[str, str] = MappingProxyType({})) -> None:
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env={**os.environ, **variables}
    )
    if done.returncode:
        reason = (done.stderr or done.stdout).strip().splitlines()
        raise PeerAbsentError(
            f"{what} cannot be installed ({reason[-1] if reason else 'no reason is given'})."
        )
