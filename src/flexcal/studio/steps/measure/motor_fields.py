"""What the columns of a recording of LeRobot's motors mean."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from typing import TYPE_CHECKING

from flexcal.errors import InputError
from flexcal.studio.window import add_fold, paragraph

if TYPE_CHECKING:
    from flexcal.studio.window import Window

_NO = "no"
_READINGS = ("ticks", "degrees", "percent")
_NONE = "Put LeRobot's calibration of the motors (a JSON file) into the folder, and open this step again."


class MotorFields:
    """Whether joint columns are readings of motors that LeRobot has calibrated, and of which; at the current place of the GUI.

    Parameters
    ----------
    window : Window
        Where they are shown.
    changed : callable
        Called in the window's thread after each change.
    """

    def __init__(self, window: Window, changed: Callable[[], None]):
        gui, choices = window.gui, window.choices
        names = [name for name in window.project.files(".json") if "/" not in name]
        self._choices = choices
        chosen = choices.among("import lerobot", [_NO, *names])
        with add_fold(gui, "Motors of LeRobot", is_open=chosen != _NO):
            if not names:
                gui.add_html(paragraph(_NONE, "faint"))
            self._file = gui.add_dropdown(
                "LeRobot's file", [_NO, *names], initial_value=chosen, visible=bool(names)
            )
            self._motors = gui.add_text(
                "Motors",
                choices.get("import motors", ""),
                hint="empty: named as the joints; else JOINT=MOTOR of each, as: pan=shoulder_pan lift=-shoulder_lift+90 (degrees)",
                visible=bool(names),
            )
            self._readings = gui.add_dropdown(
                "Readings",
                _READINGS,
                initial_value=choices.among("import readings", _READINGS),
                hint="what was recorded: ticks, or LeRobot's degrees or percent of the range (-100 to 100)",
                visible=bool(names),
            )
        for field in (self._file, self._motors, self._readings):
            field.on_update(lambda _: window.post(changed))

    @property
    def options(self) -> tuple[str, ...]:
        """Options of `flexcal import`; raises `InputError` for motors that cannot be told apart."""
        if self._file.value == _NO:
            return ()
        try:
            motors = shlex.split(self._motors.value)
        except ValueError as problem:
            raise InputError(
                "E-STUDIO-050", f"Motors: {problem}; write each as JOINT=MOTOR, with a space between two."
            ) from problem
        named = ("--motors", *motors) if motors else ()
        return ("--lerobot", self._file.value, *named, "--readings", self._readings.value)

    def keep(self) -> None:
        """Keep what was chosen."""
        self._choices.put("import lerobot", self._file.value)
        self._choices.put("import motors", self._motors.value)
        self._choices.put("import readings", self._readings.value)
