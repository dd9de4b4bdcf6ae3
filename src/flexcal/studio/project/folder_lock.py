"""One studio a folder: two would each take the rows of a file that grows."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.transaction import sole_holder


@contextmanager
def sole_studio(folder: Path) -> Iterator[None]:
    """Hold a folder as its only studio until the block or the process ends, also where it is killed.

    Raises `InputError` where another studio of this user holds it.
    """
    with sole_holder(folder, "studio", f"process {os.getpid()}") as other:
        if other is not None:
            raise InputError(
                "E-STUDIO-043",
                f"another studio ({other}) has {folder.name} open; open its URL in a second window, or end it first.",
            )
        yield
