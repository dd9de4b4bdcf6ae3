"""Where the robot comes from: a URDF of the folder, one that is uploaded, or an example."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from flexcal.errors import InputError
from flexcal.model.urdf import AmbiguousArm, find_arm, read_elements
from flexcal.studio.steps.robot.examples import examples_here
from flexcal.studio.steps.robot.uploads import write_upload
from flexcal.studio.window import Window

if TYPE_CHECKING:
    import viser

_NONE = "none in the folder"
_GUESSED = "the one long chain"


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
            options = names or [_NONE]
            self._choice = gui.add_dropdown(
                "URDF", options, initial_value=window.choices.among("urdf", options)
            )
            self._choice.on_update(lambda _: window.post(self._chosen))
            ends = self._ends()
            if ends:
                kept = self.tip or _GUESSED
                self._end = gui.add_dropdown("Arm ends at link", (_GUESSED, *ends), initial_value=kept)
                self._end.on_update(lambda _: window.post(self._ended))
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
        return self._window.choices.among("urdf", names) if names else None

    @property
    def tip(self) -> str | None:
        """The link that was chosen as the end of the arm, of a URDF with several; None for the one long chain."""
        tip = self._window.choices.get("tip", "")
        return tip if tip in self._ends() else None

    def _ends(self) -> list[str]:
        return [] if self.urdf is None else arm_ends(self._window.project.folder / self.urdf)

    def _ended(self) -> None:
        self._window.choices.put("tip", self._end.value)
        self._changed()

    def _chosen(self) -> None:
        self._window.choices.put("urdf", self._choice.value)
        self._changed()

    def _create(self) -> None:
        if self.urdf is not None:
            tip = () if self.tip is None else ("--tip", self.tip)
            self._window.command(("init", self.urdf, *tip))

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


def arm_ends(urdf: Path) -> list[str]:
    """Links where the arm of a URDF may end, in the order of the file; none where it is clear, or the URDF cannot be read."""
    try:
        find_arm(urdf)
    except AmbiguousArm:
        pass
    except InputError:
        return []
    else:
        return []
    root = read_elements(urdf)
    ends = {"parent": set[str](), "child": set[str]()}
    for joint in root.all("joint"):
        for side, links in ends.items():
            element = joint.find(side)
            if element is not None:
                links.add(element.attributes.get("link", ""))
    names = [link.attributes.get("name", "") for link in root.all("link")]
    return [name for name in names if name in ends["child"] - ends["parent"]]
