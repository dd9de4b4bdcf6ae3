"""Chromium without a window, for tests of pages."""

from __future__ import annotations

import shutil

NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
"""The shell first: it is the same engine without the browser's own windows, whose drawing costs as much as many a page."""
CHROMIUM = next((path for path in map(shutil.which, NAMES) if path), None)
"""Path of Chromium, None where it is absent."""
