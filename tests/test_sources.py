"""Works that docs and sources cite by author and year, against the list of sources."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
LIST = REPOSITORY / "docs" / "methods" / "sources.md"
CITED = re.compile(
    r"(?<!\*)\b([A-ZÅÖ][a-zà-ÿ]+(?:-[A-Z][a-zà-ÿ]+)?)(?: et al\.)?[’']?s?,? \(?((?:18|19|20)\d\d)(?=[),;.:’' ])"
)
"""The last author named, and the year."""


@pytest.mark.parametrize("folder", ["src", "docs", "kernels"])
def test_every_cited_work_is_in_the_list(folder: str) -> None:
    entries = LIST.read_text("utf-8").split("\n- ")
    missing = set()
    for file in (REPOSITORY / folder).rglob("*.*"):
        if file.suffix in (".py", ".md", ".hpp", ".cpp") and file != LIST:
            words = re.sub(r"[\s/#]+", " ", file.read_text("utf-8"))
            for name, year in CITED.findall(words):
                if not any(name in entry and year in entry for entry in entries):
                    missing.add((name, year, file.name))
    assert not missing


def test_no_work_is_listed_twice() -> None:
    entries = LIST.read_text("utf-8").split("\n- ")[1:]
    assert len(entries) == len(set(entries))
