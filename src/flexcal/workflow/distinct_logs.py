"""Logs that are told apart: one that counts twice makes intervals too narrow, and one that was fitted is not unseen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flexcal.errors import InputError


def require_distinct(logs: Sequence[Path], unseen: Sequence[Path] = ()) -> None:
    """Raises `InputError` for a file that stands twice among the `logs` of a fit or those that it is not to see, or among both."""
    fitted, others = set[Path](), set[Path]()
    for given, before in ((logs, fitted), (unseen, others)):
        for log in given:
            if log.resolve() in before:
                raise InputError(f"{log} is given twice; it would count as two recordings: name it once.")
            before.add(log.resolve())
    both = [log for log in unseen if log.resolve() in fitted]
    if both:
        raise InputError(
            f"{both[0]} is fitted and stands under --validate too; the fit must not have seen what it is validated with."
        )
