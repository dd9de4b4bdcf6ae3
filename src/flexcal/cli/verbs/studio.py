"""`flexcal studio`."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import Positional, arg

from flexcal.cli.arguments.shared_options import Json, MaybeCount
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted

if TYPE_CHECKING:
    from flexcal.studio.server import StudioServer

_LOOPBACK = "127.0.0.1"
_WARNING = (
    "warning: whoever knows this address can read and change the folder and compute on this machine; "
    "nothing is encrypted, so that others on the network can read all of it, the address too"
)


@dataclass(frozen=True)
class Studio:
    """Open a project folder in a window of the browser: the same files and computations as on the command line.

    Only this machine reaches it, at the address that is printed, which has a secret in it. Close the window any time: all is in the
    folder. Ctrl-C stops it.
    """

    out: ClassVar[None] = None
    folder: Annotated[Positional[Path], arg(metavar="[DIR]", help="project folder, which may be empty")] = (
        Path()
    )
    host: Annotated[str, arg(metavar="ADDRESS")] = _LOOPBACK
    """Address of this machine to listen on; all but 127.0.0.1 let others in who know the address, unencrypted. 0.0.0.0: all."""
    port: Annotated[
        MaybeCount,
        arg(metavar="N", help_behavior_hint="(default: 8080, or the next that is free)"),
    ] = None
    """TCP port; 0 takes any free one."""
    no_browser: bool = False
    """Print the address only."""
    json: Json = False

    def run(self) -> None:
        """Serve until stopped."""
        from flexcal.studio import run_studio

        with ExitStack() as at_end:
            run_studio(self.folder, self.host, self.port, partial(self._ready, at_end))
        console = Console(self.json)
        console.say("the studio is closed")
        console.finish({"folder": str(self.folder)}, f"flexcal studio {quoted(self.folder)}")

    def _ready(self, at_end: ExitStack, server: StudioServer) -> None:
        lines = [f"the studio is open at {server.url}", "Ctrl-C stops it"]
        if self.host not in (_LOOPBACK, "localhost", "::1"):
            lines.insert(0, _WARNING)
        # standard output is shown when a verb has ended
        print("\n".join(lines), file=sys.stderr, flush=True)
        if not self.no_browser and _has_display():
            with suppress(OSError):  # without a place for the page, the printed address is left
                _open_browser(server.url, at_end)


def _open_browser(url: str, at_end: ExitStack) -> None:
    """Lead the browser to the studio by a page that is removed `at_end`."""
    import threading
    import webbrowser

    from flexcal.studio.server import redirecting_page

    page = at_end.enter_context(redirecting_page(url))
    # some browsers are waited for until they are closed
    threading.Thread(target=webbrowser.open, args=(page,), daemon=True).start()


def _has_display() -> bool:
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
