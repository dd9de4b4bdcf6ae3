"""Considered terms of a calibration, as lines of the console."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def considered_lines(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line a term of `term_selection` in results.json; compliances of single joints that were left stand in one line together."""
    lines, joints = [], []
    for row in rows:
        term = row["term"]
        if term is None:
            continue
        if not row["taken"] and "." in term:
            joints.append(term)
            continue
        lines.append(
            f"considered {term}: {'taken, because it' if row['taken'] else 'left, because'} {row['reason']}"
        )
    if joints:
        lines.append(
            f"considered for single joints and left, because left-out poses or the BIC do not support them: {', '.join(joints)}"
        )
    return lines
