"""A page in Debian's Chromium, and a studio to show there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser import ARGUMENTS, studio
from headless import CHROMIUM
from page_elements import WAIT


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium without a window, one for all tests; they are skipped where it or Playwright is absent."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is absent")
    if CHROMIUM is None:
        pytest.skip("Chromium is absent: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A page of 1280 × 720 in a fresh profile."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.set_default_timeout(WAIT)
    yield context.new_page()
    context.close()


@pytest.fixture
def studio_url(tmp_path: Path) -> Iterator[str]:
    """URL of a studio on the empty folder `tmp_path / "project"`."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    folder = tmp_path / "project"
    folder.mkdir()
    with studio(folder) as running:
        yield running.url
