"""A headless Chromium, asked through its own protocol on two pipes; for measuring pages."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.peers import PeerAbsentError

PROGRAM = next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)


def require_chromium() -> None:
    """Raise `PeerAbsentError` where there is no browser."""
    if PROGRAM is None:
        raise PeerAbsentError("there is no Chromium on this machine")


def require_viser() -> None:
    """Raise `PeerAbsentError` where the studio cannot be opened."""
    try:
        import viser  # noqa: F401
    except ImportError as problem:
        raise PeerAbsentError("viser is not installed") from problem


class Tab:
    """One tab of a browser."""

    def __init__(self, to_browser: int, from_browser: int) -> None:
        self._out, self._in = to_browser, from_browser
        self._numbers = itertools.count(1)
        self._rest = b""
        self._session: str | None = None
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.ask("Page.enable")

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The result of one call; raises `RuntimeError` with what the browser says where it fails."""
        number = next(self._numbers)
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        answer = self._wait(lambda found: found.get("id") == number)
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def open(self, page: Path) -> None:
        """Load a file, to the end of its load event."""
        self.ask("Page.navigate", url=page.resolve().as_uri())
        self._wait(lambda found: found.get("method") == "Page.loadEventFired")

    def value(self, script: str) -> Any:
        """What an expression becomes in the page; a promise is waited for."""
        answer = self.ask("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(str(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def _wait(self, wanted: Any) -> dict[str, Any]:
        while True:
            while b"\0" not in self._rest:
                read = os.read(self._in, 2**20)
                if not read:
                    raise RuntimeError("the browser has gone")
                self._rest += read
            message, _, self._rest = self._rest.partition(b"\0")
            found = json.loads(message)
            if wanted(found):
                return found


@contextmanager
def chromium(*flags: str) -> Iterator[Tab]:
    """A browser with an empty profile for a time."""
    assert PROGRAM is not None
    (read_by_it, to_it), (from_it, written_by_it) = os.pipe(), os.pipe()
    # the browser reads descriptor 3 and writes 4
    shell = f'exec "$0" "$@" 3<&{read_by_it} 4>&{written_by_it}'
    with TemporaryDirectory(prefix="flexcal_chromium_", ignore_cleanup_errors=True) as profile:
        command = [
            "sh", "-c", shell, PROGRAM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
            "--remote-debugging-pipe", f"--user-data-dir={profile}", *flags,
        ]  # fmt: skip
        process = subprocess.Popen(
            command,
            pass_fds=(read_by_it, written_by_it),
            stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )
        os.close(read_by_it)
        os.close(written_by_it)
        try:
            yield Tab(to_it, from_it)
        finally:
            process.terminate()
            process.wait(10)
            os.close(to_it)
            os.close(from_it)
