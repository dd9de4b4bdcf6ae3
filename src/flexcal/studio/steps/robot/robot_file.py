"""robot.yaml as the page changes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.errors import InputError
from flexcal.files.structuring import Keys
from flexcal.files.transaction import read_bytes, write_text
from flexcal.studio.window import Window


class RobotFile:
    """robot.yaml of a window's project, whose last changes can be taken back as long as nobody else has changed it.

    Parameters
    ----------
    window : Window
        Where it is said what changed.
    """

    def __init__(self, window: Window):
        self._window = window
        self._changes: list[tuple[str, bytes, bytes]] = []

    @property
    def last_change(self) -> str | None:
        """What the last change was; None where there is none to take back."""
        return self._changes[-1][0] if self._changes and self._changes[-1][2] == self._content() else None

    def edit(self, changes: Mapping[Keys, Any], told: str) -> None:
        """Set values, or remove them, as `edit_robot` does, and say so; raises as that does."""
        from flexcal.jobs.setup import edit_robot

        before = self._content()
        edit_robot(self._window.project.robot_file, changes)
        self._changes.append((told, before, self._content()))
        self._window.say(f"robot.yaml: {told}.", "good")

    def take_back(self) -> None:
        """Write the file as it was before the last change."""
        if self.last_change is None:
            return
        told, before, _ = self._changes.pop()
        write_text(self._window.project.robot_file, before.decode("utf-8"))
        self._window.say(f"robot.yaml: taken back: {told}.", "good")

    def _content(self) -> bytes:
        try:
            return read_bytes(self._window.project.robot_file)
        except (InputError, OSError):
            return b""
