"""Where the page of a plan or a map is; without what reads plans, for verbs that read none."""

from __future__ import annotations

from pathlib import Path


def page_beside(plan: Path) -> Path:
    """Path of the page of a plan, beside it."""
    return plan.with_suffix(".html")
