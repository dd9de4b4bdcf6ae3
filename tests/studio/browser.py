"""Arguments of Chromium, and the studio as a process of its own, for tests."""

from __future__ import annotations

import multiprocessing
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.context import ForkServerProcess
from pathlib import Path

from waiting import PATIENCE

ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu-compositing",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
"""So that WebGL is drawn without a graphics card, and as root."""

_LOADED = multiprocessing.get_context("forkserver")
_LOADED.set_forkserver_preload(
    [
        "flexcal.cli.main",
        "flexcal.cli.verbs.studio",
        "flexcal.studio.server.studio_server",
        "flexcal.studio.window.window",
        *(
            f"flexcal.studio.steps.{step}.{step}_step"
            for step in ("robot", "plan", "measure", "calibrate", "verify", "compare")
        ),
    ]
)
"""Processes that are forked off one which has loaded the studio: a hundred of them would else load it for two minutes together."""


@dataclass
class Running:
    """A studio in a process of its own, what it has said on standard error at its start, and the files of its output and errors."""

    process: ForkServerProcess
    url: str
    said: list[str]
    output: Path
    errors: Path

    @property
    def alive(self) -> bool:
        """Whether the process has not ended."""
        return self.process.exitcode is None

    def kill(self) -> None:
        """End it at once, by SIGKILL."""
        self.process.kill()
        self.process.join(PATIENCE)

    def stop(self, number: int) -> str:
        """Standard output after a signal that ends it."""
        assert self.process.pid is not None
        os.kill(self.process.pid, number)
        self.process.join(PATIENCE)
        assert not self.alive
        return self.output.read_text("utf-8")


def _serve(arguments: list[str], environment: dict[str, str], output: Path, errors: Path) -> None:
    for number, file in ((1, output), (2, errors)):
        handle = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(handle, number)
        os.close(handle)
    os.environ.clear()
    os.environ.update(environment)
    from flexcal.cli.main import main

    raise SystemExit(main(arguments))


@contextmanager
def studio(folder: Path, *arguments: str, browser: bool = False) -> Iterator[Running]:
    """A studio on a folder, killed after; it opens a browser where told to."""
    command = ["studio", str(folder), *arguments]
    if not browser:
        command.append("--no-browser")
    if "--port" not in arguments:
        command += ["--port", "0"]
    with tempfile.TemporaryDirectory() as files:
        output, errors = Path(files, "output"), Path(files, "errors")
        errors.touch()
        process = _LOADED.Process(target=_serve, args=(command, dict(os.environ), output, errors))
        process.start()
        running = Running(process, "", [], output, errors)
        try:
            deadline = time.monotonic() + PATIENCE
            while True:
                said = errors.read_text("utf-8").splitlines()
                if said and said[-1] == "Ctrl-C stops it":
                    break
                assert running.alive and time.monotonic() < deadline, said
                time.sleep(0.02)
            running.url, running.said = said[-2].split()[-1], said
            yield running
        finally:
            if not running.alive:  # shown with the test that fails of it
                print(f"the studio had ended, {process.exitcode}: {errors.read_text('utf-8')}")
            running.kill()
