"""Debian's Chromium, and the studio as a process of its own, for tests."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ARGUMENTS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
"""So that WebGL is drawn without a graphics card, and as root."""


def chromium() -> str | None:
    """Path of Chromium, None where it is absent."""
    return shutil.which("chromium") or shutil.which("chromium-browser")


@contextmanager
def studio(folder: Path, *arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The process of `flexcal studio` on a folder, and its URL; killed after."""
    command = [sys.executable, "-m", "flexcal.cli.main", "studio", str(folder), "--no-browser", *arguments]
    if "--port" not in arguments:
        command += ["--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ}) as process:
        assert process.stderr is not None
        try:
            said = process.stderr.readline()
            assert "http://" in said, said + process.stderr.read()
            yield process, said.split()[-1]
        finally:
            process.kill()
            process.wait(10)
