"""Numbers that a design verb left in the page beside its plan."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from flexcal.data.plans import page_beside
from flexcal.errors import InputError
from flexcal.files.transaction import read_text

_RESULTS = re.compile(r'<script type="application/json" id="results">(.*?)</script>', re.DOTALL)


def plan_results(plan: Path) -> dict[str, Any]:
    """The JSON document in the page beside a plan; empty where there is no page, or one older than the plan."""
    page = page_beside(plan)
    try:
        if page.stat().st_mtime < plan.stat().st_mtime - _PATIENCE:
            return {}
        text = read_text(page)
    except (InputError, OSError, UnicodeError):
        return {}
    match = _RESULTS.search(text)
    if match is None:
        return {}
    try:
        document = json.loads(match.group(1))
    except (ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


_PATIENCE = 60.0
"""Seconds by which the page may be older: the verb writes it just before or just after the plan."""
