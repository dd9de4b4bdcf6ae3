"""Where the robot comes from: a URDF of the folder, one that is uploaded, or an example."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from flexcal.studio.steps.robot.examples import examples_here
from flexcal.studio.steps.robot.uploads import write_upload
from flexcal.studio.window import Window

if TYPE_CHECKING:
    import viser

_NONE = "none in the folder"


class UrdfChoice:
    """A choice of the folder's URDFs, and ways to bring one there.

    Parameters
    ----------
    window : Window
        Where it is shown: elements are added at the current place of its GUI.
    described : bool
        Whether there is a robot.yaml.
    changed : callable
        Called when another URDF has been chosen.
    """

    def __init__(self, window: Window, *, described: bool, changed: Callable[[], None]):
        self._window, self._changed = window, changed
        gui = window.gui
        names = window.project.files(".urdf")
        if not described:
            kept = window.choices.get("urdf", "")
            first = kept if kept in names else (names or [_NONE])[0]
            self._choice = gui.add_dropdown("URDF", names or [_NONE], initial_value=first)
            self._choice.on_update(lambda _: window.post(self._chosen))
            if names:
                window.button(
                    "Create robot.yaml",
                    self._create,
                    hint="$ flexcal init URDF: with comments on what to complete",
                    main=True,
                )
        upload = gui.add_upload_button(
            "Upload a URDF or mesh", hint="the file is copied into the folder", color="gray"
        )
        upload.on_upload(self._arrived)
        self._replace = gui.add_checkbox("Replace a file of the same name", False)
        examples = [] if described or names else examples_here()
        if examples:
            self._examples = {example.title: example for example in examples}
            self._example = gui.add_dropdown("Example", tuple(self._examples))
            window.button("Copy the example into the folder", self._copy)

    @property
    def urdf(self) -> str | None:
        """Name of the chosen URDF; None where the folder has none."""
        names = self._window.project.files(".urdf")
        kept = self._window.choices.get("urdf", "")
        return kept if kept in names else names[0] if names else None

    def _chosen(self) -> None:
        self._window.choices.put("urdf", self._choice.value)
        self._changed()

    def _create(self) -> None:
        if self.urdf is not None:
            self._window.command(("init", self.urdf))

    def _copy(self) -> None:
        names = self._examples[self._example.value].copy_to(self._window.project)
        self._window.say(f"copied into the folder: {', '.join(names)}.", "good")

    def _arrived(self, event: viser.GuiEvent[viser.GuiUploadButtonHandle]) -> None:
        file = event.target.value
        self._window.post(lambda: self._take(file.name, file.content))

    def _take(self, name: str, content: bytes) -> None:
        project = self._window.project
        place = write_upload(project, name, content, replace=self._replace.value)
        written = place.relative_to(project.folder).as_posix()
        if place.suffix == ".urdf":
            self._window.choices.put("urdf", written)
        self._window.say(f"{written} is in the folder ({len(content) / 1000:.0f} kB).", "good")
