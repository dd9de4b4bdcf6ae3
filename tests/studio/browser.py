"""Debian's Chromium, and the studio as a process of its own, for tests."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
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


def chromium() -> str | None:
    """Path of Chromium, None where it is absent."""
    return shutil.which("chromium") or shutil.which("chromium-browser")


@dataclass
class Running:
    """A studio in a process of its own, and what it has said on standard error so far."""

    process: subprocess.Popen[str]
    url: str
    said: list[str]

    def stop(self, number: int) -> str:
        """Standard output after a signal that ends it."""
        self.process.send_signal(number)
        said, _ = self.process.communicate(timeout=PATIENCE)
        return said


@contextmanager
def studio(folder: Path, *arguments: str, browser: bool = False) -> Iterator[Running]:
    """A studio on a folder, killed after; it opens a browser where told to."""
    command = [sys.executable, "-m", "flexcal.cli.main", "studio", str(folder), *arguments]
    if not browser:
        command.append("--no-browser")
    if "--port" not in arguments:
        command += ["--port", "0"]
    with (
        tempfile.TemporaryFile("w+", encoding="utf-8") as errors,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True) as process,
    ):
        try:
            deadline = time.monotonic() + PATIENCE
            while True:
                errors.seek(0)
                said = errors.read().splitlines()
                if said and said[-1] == "Ctrl-C stops it":
                    break
                assert process.poll() is None and time.monotonic() < deadline, said
                time.sleep(0.02)
            yield Running(process, said[-2].split()[-1], said)
        finally:
            process.kill()
            process.wait(PATIENCE)
