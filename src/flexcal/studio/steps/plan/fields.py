"""Fields of a form whose values are kept in the project's folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import viser

    from flexcal.studio.window import Window


class Fields:
    """Fields at the current place of a window's GUI, each with what was last entered.

    Parameters
    ----------
    window : Window
        Where they are added.
    form : str
        Name under which their values are kept.
    changed : callable
        Called in the window's thread after each change.
    """

    def __init__(self, window: Window, form: str, changed: Callable[[], None]):
        self._window, self._form, self._changed = window, form, changed

    def number(
        self,
        name: str,
        label: str,
        default: float,
        *,
        least: float,
        step: float,
        hint: str,
        most: float | None = None,
    ) -> viser.GuiNumberHandle[Any]:
        """A number; a whole one where `default` is."""
        value = self._window.choices.number(f"plan.{self._form}.{name}", default, least, most)
        field = self._window.gui.add_number(label, value, min=least, max=most, step=step, hint=hint)
        return self._kept(field, name, type(default))

    def choice(
        self, name: str, label: str, options: Sequence[str], *, hint: str
    ) -> viser.GuiDropdownHandle[Any]:
        """One of some texts, the first by default."""
        value = self._window.choices.among(f"plan.{self._form}.{name}", options)
        field = self._window.gui.add_dropdown(label, tuple(options), initial_value=value, hint=hint)
        return self._kept(field, name, str)

    def tick(self, name: str, label: str, *, hint: str) -> viser.GuiCheckboxHandle:
        """A yes or no, no by default."""
        value = self._window.choices.get(f"plan.{self._form}.{name}", False)
        return self._kept(self._window.gui.add_checkbox(label, value, hint=hint), name, bool)

    def text(self, name: str, label: str, default: str, *, hint: str) -> viser.GuiTextHandle:
        """A text."""
        value = self._window.choices.get(f"plan.{self._form}.{name}", default)
        return self._kept(self._window.gui.add_text(label, value, hint=hint), name, str)

    def _kept(self, field: Any, name: str, kind: Callable[[Any], Any]) -> Any:
        def keep() -> None:
            self._window.choices.put(f"plan.{self._form}.{name}", kind(field.value))
            self._changed()

        field.on_update(lambda _: self._window.post(keep))
        return field
