"""Runs command lines of flexcal, one a forked process each: `python fuzz_worker.py`, told by `fuzz_process`, one JSON document a line.

A process of its own, since a fork of one with threads may hang; forked, since the imports take longer than the runs.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from importlib import import_module

CPU_SECONDS = 20
WALL_SECONDS = 120
MEMORY = 6 * 2**30


def import_everything() -> None:
    """All verbs, and what they import when they run: modules only, so that no thread is started."""
    from flexcal.cli import main
    from flexcal.cli.arguments.verb_table import VERBS, command_class

    for verb in VERBS:
        command_class(verb)
    for name in (
        "polars",
        "scipy.optimize",
        "scipy.signal",
        "scipy.stats",
        "pinocchio",
        "mujoco",
        "rich.console",
        "rich.progress",
    ):
        import_module(name)
    for name in ("yaml", "cattrs.gen", "jinja2", "plotly.graph_objects", "clarabel", "tyro"):
        import_module(name)
    assert main


def carry_out(arguments: list[str], folder: str) -> dict[str, object]:
    """Exit status (negative: the signal that ended it), both outputs and seconds of one command line in `folder`."""
    begun = time.monotonic()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = os.fork()
        if child == 0:
            _run(arguments, folder, out.fileno(), err.fileno())
        status, late = _wait(child, begun + WALL_SECONDS)
        texts = []
        for stream in (out, err):
            stream.seek(0)
            texts.append(stream.read(2_000_000).decode("utf-8", "backslashreplace"))
    seconds = time.monotonic() - begun
    return {"status": status, "late": late, "out": texts[0], "err": texts[1], "seconds": seconds}


def _run(arguments: list[str], folder: str, out: int, err: int) -> None:
    status = 70
    try:
        os.setsid()
        os.chdir(folder)
        os.dup2(out, 1)
        os.dup2(err, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 5))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        from flexcal.cli.main import main

        status = main(arguments)
        sys.stdout.flush()
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(status)


def _wait(child: int, deadline: float) -> tuple[int, bool]:
    pause = 0.001
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            code = os.waitstatus_to_exitcode(status)
            return code, code == -signal.SIGXCPU
        if time.monotonic() > deadline:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return -signal.SIGKILL, True
        time.sleep(pause)
        pause = min(2 * pause, 0.02)


def serve() -> None:
    """Answer requests {arguments, folder} on standard input until it ends."""
    import_everything()
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(carry_out(request["arguments"], request["folder"])), flush=True)


if __name__ == "__main__":
    serve()
