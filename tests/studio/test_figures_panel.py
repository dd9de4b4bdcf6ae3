"""The panel of figures begins folded where it would hide the scene, and only there."""

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

from flexcal.studio.window.figures_panel import FiguresPanel


class _Server:
    """A window of a browser, whose scene is `width` pixels wide as far as it has told."""

    def __init__(self, width: int):
        self.width, self.folded = width, False
        self.gui = SimpleNamespace(add_panel=self._panel)

    def get_clients(self) -> dict[int, Any]:
        return {0: SimpleNamespace(camera=SimpleNamespace(image_width=self.width))}

    def _panel(self) -> Any:
        self.folded = False
        nothing = dict.fromkeys(("dock_left", "set_width", "remove"), lambda *_: None)
        return SimpleNamespace(add_tab=lambda _: nullcontext(), minimize=self._fold, **nothing)

    def _fold(self) -> None:
        self.folded = True


@pytest.mark.parametrize(("free", "folded"), [(880, False), (624, False), (420, True)])
def test_another_step_does_not_fold_it(free: int, folded: bool) -> None:
    """Right after a panel was taken away the browser still tells the width beside it."""
    server = _Server(free)
    panel = FiguresPanel(server)  # type: ignore[arg-type]
    for _ in range(3):
        panel.show({"Poses": lambda: None})
        assert server.folded is folded
        server.width = free - (40 if folded else 380)
        panel.clear()
