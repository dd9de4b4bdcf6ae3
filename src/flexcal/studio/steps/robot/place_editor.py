"""Measured points, payload and instrument: in the scene, as numbers, and in robot.yaml."""

from __future__ import annotations

import re
from dataclasses import replace

from flexcal.errors import InputError
from flexcal.files.formats import REMOVED
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import read_urdf
from flexcal.studio.steps.robot.place_markers import PlaceMarkers
from flexcal.studio.steps.robot.places import BASE, Place, Triple, places_of
from flexcal.studio.steps.robot.robot_file import RobotFile
from flexcal.studio.window import Place as GuiPlace
from flexcal.studio.window import Window, add_fold, paragraph, table

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,39}")
_FARTHEST, _HEAVIEST = 99_999.999, 9_999.999
"""Largest numbers of the fields, mm and kg; they have the decimals that can be typed."""
_BEGUN = "places not written"
_KINDS = ("measured point", "payload", "instrument")


class PlaceEditor:
    """The places of robot.yaml, of which one at a time is edited; nothing is written before its button says so.

    Parameters
    ----------
    window : Window
        Where it is shown: elements are added at the current place of its GUI.
    model : RobotModel
        The robot as robot.yaml has it.
    file : RobotFile
        That file.
    """

    def __init__(self, window: Window, model: RobotModel, file: RobotFile):
        self._window, self._model, self._file = window, model, file
        self._frames = read_urdf(model.urdf, model.config.locked).frames
        self._markers = PlaceMarkers(window, self._frames)
        self._marked: Triple = (0.0, 0.0, 0.0)
        self.places = places_of(model)
        titles = [place.title for place in self.places]
        kept = window.choices.get("place", "")
        self._index = titles.index(kept) if kept in titles else 0 if titles else None
        gui = window.gui
        self._table = gui.add_html(
            table(("", "frame", "x, y, z / mm", "mass"), [p.row() for p in self.places])
        )
        if self._index is not None:
            self._choice = gui.add_dropdown("Edit", titles, initial_value=titles[self._index])
            self._choice.on_update(lambda _: window.post(self._choose))
        self._fields = GuiPlace(gui)
        if file.last_change is not None:
            window.button("Take the last change back", file.take_back, hint=file.last_change)
        with add_fold(gui, "Add a point, payload or instrument", is_open=not self.places):
            self._kind = gui.add_dropdown("What", self._kinds())
            self._name = gui.add_text(
                "Name",
                window.choices.get("new place", ""),
                hint="letters, digits and _; the columns of files have it",
            )
            self._name.on_update(
                lambda _: window.post(lambda: window.choices.put("new place", self._name.value))
            )
            window.button("Add to robot.yaml", self._add)
        self._show()

    def follow(self) -> None:
        """Put the markers on the robot again where it has been drawn anew."""
        if self._markers.stale:
            self._mark()

    def close(self) -> None:
        """Take the markers out of the scene; what was asked for meanwhile is no longer done."""
        self._markers.remove()
        self._index = None

    @property
    def _saved(self) -> Place:
        assert self._index is not None
        return self.places[self._index]

    def _kinds(self) -> tuple[str, ...]:
        has_load = any(place.kind == "payload" for place in self.places)
        return tuple(kind for kind in _KINDS if kind != "payload" or not has_load)

    def _show(self) -> None:
        with self._fields.anew():
            if self._index is None:
                return
            place, gui, window = self._begun(), self._window.gui, self._window
            frames = (BASE,) if place.frame == BASE else tuple(self._frames)
            self._frame = gui.add_dropdown(
                "Frame", frames, initial_value=place.frame, disabled=place.frame == BASE
            )
            of = "centre of mass " if place.kind == "payload" else ""
            self._xyz = [
                gui.add_number(
                    f"{of}{axis} / mm", value, min=min(-_FARTHEST, value), max=max(_FARTHEST, value), step=0.1
                )
                for axis, value in zip("xyz", place.xyz, strict=True)
            ]
            self._mass = None
            if place.mass is not None:
                heaviest = max(_HEAVIEST, place.mass)
                self._mass = gui.add_number("Mass / kg", place.mass, min=0.0, max=heaviest, step=0.1)
                self._mass.on_update(lambda _: window.post(self._edited))
            self._frame.on_update(lambda _: window.post(self._reframed))
            for number in self._xyz:
                number.on_update(lambda _: window.post(self._edited))
            self._difference = gui.add_html("")
            self._write = window.button("Write to robot.yaml", self._save, main=True)
            self._back = window.button("Keep what robot.yaml has", self._forget)
            self._write.visible = self._back.visible = False
            window.button(f"Remove {place.title}", self._remove)
        self._mark()
        self._tell()

    def _begun(self) -> Place:
        """The place that is edited, with what was typed and not written yet."""
        saved, frames = self._saved, (BASE, *self._frames)
        begun = self._window.choices.get(_BEGUN, {}).get(saved.title)
        frame, *numbers = begun if isinstance(begun, list) and begun else [saved.frame]
        values = [float(n) for n in numbers if isinstance(n, int | float) and abs(n) <= _FARTHEST]
        count = 3 + (saved.mass is not None)
        if (
            frame not in frames
            or not len(numbers) == len(values) == count
            or min(values[3:], default=0.0) < 0
        ):
            return saved
        x, y, z, *mass = values
        return replace(saved, frame=frame, xyz=(x, y, z), mass=mass[0] if mass else None)

    def _forget(self) -> None:
        """Show the place that is edited as robot.yaml has it."""
        self._keep(None)
        self._show()

    def _keep(self, place: Place | None) -> None:
        """Keep what is not written yet."""
        begun = dict(self._window.choices.get(_BEGUN, {}))
        begun.pop(self._saved.title, None)
        if place is not None:
            begun[self._saved.title] = [
                place.frame,
                *place.xyz,
                *([] if place.mass is None else [place.mass]),
            ]
        self._window.choices.put(_BEGUN, begun)

    def _mark(self) -> None:
        """Show all places in the scene, the one that is edited as it is in the fields."""
        shown = list(self.places)
        if self._index is not None:
            shown[self._index] = self._edited_place()
            self._marked = shown[self._index].xyz
        self._markers.show(shown, self._index, lambda xyz: self._window.post(lambda: self._dragged(xyz)))

    def _edited_place(self) -> Place:
        x, y, z = (round(float(number.value), 6) for number in self._xyz)
        mass = None if self._mass is None else float(self._mass.value)
        return replace(self._saved, frame=self._frame.value, xyz=(x, y, z), mass=mass)

    def _choose(self) -> None:
        titles = [place.title for place in self.places]
        self._index = titles.index(self._choice.value)
        self._window.choices.put("place", self._choice.value)
        self._show()

    def _dragged(self, xyz: Triple) -> None:
        if self._index is None:
            return
        for number, value in zip(self._xyz, xyz, strict=True):
            number.value = value
        self._marked = xyz
        self._markers.move(xyz, handle=False)
        self._tell()

    def _edited(self) -> None:
        if self._index is None:
            return
        xyz = self._edited_place().xyz
        if xyz != self._marked:  # else it is the echo of a drag
            self._marked = xyz
            self._markers.move(xyz)
        self._tell()

    def _reframed(self) -> None:
        if self._index is None:
            return
        self._mark()
        self._tell()

    def _tell(self) -> None:
        """Say what is not written yet."""
        told = self._saved.told_changes(self._edited_place())
        self._keep(self._edited_place() if told else None)
        self._difference.content = paragraph(
            f"not written yet: {told}"
            if told
            else "As in robot.yaml. Drag it in the scene, or type the numbers.",
            "warning" if told else "faint",
        )
        if self._write.visible != bool(told):
            self._write.visible = self._back.visible = bool(told)

    def _save(self) -> None:
        place, saved = self._edited_place(), self._saved
        self._keep(None)
        self._file.edit(saved.changes(place), f"{saved.title}: {saved.told_changes(place)}")

    def _remove(self) -> None:
        self._file.edit({self._saved.keys: REMOVED}, f"{self._saved.title} removed")

    def _add(self) -> None:
        place = self._new_place()
        self._window.choices.put("place", place.title)
        self._window.choices.put("new place", "")
        self._file.edit(
            {place.keys: place.entry()}, f"{place.title} added at {place.row()[2]} mm in {place.frame}"
        )

    def _new_place(self) -> Place:
        kind, name = self._kind.value, self._name.value.strip()
        reach = round(1000.0 * max(self._model.reach, 0.3), -1)
        carrier = next((place.frame for place in self.places if place.frame != BASE), list(self._frames)[-1])
        if kind == "payload":
            return Place("payload", "payload", carrier, (0.0, 0.0, 100.0), 1.0)
        config = self._model.config
        if not _NAME.fullmatch(name) or name in config.points or name in config.stations:
            raise InputError(
                "E-STUDIO-029",
                f"'{name}' cannot be the name of another {kind}; give one of letters, digits and _ that robot.yaml does not have yet.",
            )
        if kind == "instrument":
            return Place("instrument", name, BASE, (2.0 * reach, 0.0, round(0.5 * reach, -1)))
        return Place("measured point", name, carrier, (0.0, 0.0, 0.0))
