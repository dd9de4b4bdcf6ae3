"""A page on disk that leads a browser to the studio."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path


@contextmanager
def redirecting_page(url: str) -> Iterator[str]:
    """`file:` address of a page that leads to `url` and that its owner alone can read; it is removed at the end of the block.

    Programs that are started with an address show it to all users of a machine: the token must not be in it.
    """
    with tempfile.TemporaryDirectory(prefix="flexcal-studio-") as folder:
        page = Path(folder, "open.html")
        handle = os.open(page, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(
                '<!DOCTYPE html><meta charset="utf-8"><title>flexcal studio</title>'
                f'<meta http-equiv="refresh" content="0; url={escape(url)}"><a href="{escape(url)}">Open the studio</a>\n'
            )
        yield page.as_uri()
