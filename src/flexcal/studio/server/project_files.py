"""Files of a project folder for the browser to show."""

from __future__ import annotations

import os
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import open_regular, real_path
from flexcal.studio.server.answer import PLAIN, Answer, said

_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".csv": PLAIN,
    ".yaml": PLAIN,
    ".urdf": PLAIN,
    ".xml": PLAIN,
    ".sdf": PLAIN,
    ".h": PLAIN,
    ".json": "application/json",
    ".png": "image/png",
}
_POLICY = (
    "sandbox allow-scripts allow-downloads allow-modals; default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; worker-src blob:; form-action 'none'; base-uri 'none'; "
    "frame-ancestors 'none'"
)
"""A page may be anybody's: it runs its own scripts, as figures need, in an origin of its own, and loads nothing.

It can still send away what it knows, by leading the window elsewhere or by WebRTC: its content, and its address, which opens nothing else.
"""
_LARGEST = 1 << 26
"""Bytes of a file."""


class ProjectFiles:
    """The route to pages and results inside a folder, to be read only: .html, .csv, .yaml, .urdf, .xml, .sdf, .h, .json and .png.

    Nothing outside is read, wherever links lead; folders are not listed, and hidden files and folders stay so.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = real_path(folder)

    def __call__(self, path: str) -> Answer | None:
        """As `Route`."""
        kind = _KINDS.get(Path(path).suffix)
        parts = path.split("/")
        if kind is None or any(not part or part.startswith(".") for part in parts):
            return None
        if "\\" in path or any(ord(letter) < 32 for letter in path):
            return None
        try:
            found = (self._folder / path).resolve(strict=True)
            if not found.is_relative_to(self._folder) or found.suffix != Path(path).suffix:
                return None
            content = _read(found)
        except (InputError, OSError, ValueError, RuntimeError):
            return None
        if content is None:
            return said(413, f"The file is larger than {_LARGEST >> 20} MiB; open it from the folder.")
        return Answer(200, kind, content, _POLICY)


def _read(path: Path) -> bytes | None:
    """What a regular file holds, None where that is too much; raises `OSError` where it is none."""
    with open_regular(path, limit=None) as file:
        if not os.path.samestat(os.fstat(file.fileno()), path.lstat()):
            raise OSError(f"{path} has been replaced by a link")
        content = file.read(_LARGEST + 1)
    return content if len(content) <= _LARGEST else None
