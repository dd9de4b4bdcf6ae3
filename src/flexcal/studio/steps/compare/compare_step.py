"""Comparison of two calibrations of one robot: what changed beyond chance, and how far the tool moved where."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.jobs.result_files import RESULTS
from flexcal.studio.commands import command_line
from flexcal.studio.project import CALIBRATION
from flexcal.studio.steps.compare.kept_calibrations import calibrations, keep_calibration
from flexcal.studio.window import (
    MagnifiedArrows,
    Place,
    Step,
    Window,
    add_sections,
    add_verdict,
    command_text,
    figure_tab,
    heading,
    paragraph,
    step_link,
)
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    import viser

    from flexcal.report.results import Comparison

_UNCHANGED = (
    "Next: the earlier calibration still holds as far as these points tell; a few fresh poses would verify it. They do not tell what looks "
    "like an instrument that stands elsewhere, such as another zero of the first joint or a base that was shifted, nor another zero of the "
    "last joint where the point is near its axis: after a crash, approach a known point of the cell too."
)


class CompareStep(Step):
    """Comparison of two calibrations of one robot, such as last year's and today's, or before and after a crash."""

    title = "Compare"

    def __init__(self, window: Window):
        super().__init__(window)
        self._arrows: MagnifiedArrows | None = None
        self._names: tuple[str, ...] = ()
        self._dark = window.dark
        self._stamp: object = None
        self._kept: tuple[object, Comparison] | None = None

    def open(self) -> None:
        """Add the choice of two calibrations and the place of the result."""
        self._stamp, self._names = None, ()
        self._place = Place(self.window.gui)
        self._result = Place(self.window.gui)

    def refresh(self) -> None:
        """Offer the calibrations that are in the folder."""
        names, dark = tuple(calibrations(self.window.project)), self.window.dark
        if (names, dark) == (self._names, self._dark) and self._stamp is not None:
            return
        self._names, self._dark, self._stamp = names, dark, object()
        with self._place.anew():
            self._add_choice(names)
        self._show_again()

    def close(self) -> None:
        """Remove the arrows from the scene."""
        self._stamp = None
        self._remove_arrows()

    def _add_choice(self, names: tuple[str, ...]) -> None:
        gui = self.window.gui
        if CALIBRATION in names:
            self.window.button(
                "Keep a copy of the calibration",
                self._keep,
                hint="copies the folder 'calibration' to one with today's date, before the next calibration replaces it",
            )
        if len(names) < 2:
            gui.add_html(
                paragraph(
                    "Two calibrations of this robot are needed: keep a copy of the present one, and measure and calibrate again "
                    "later, or put an earlier calibration's folder into this one.",
                    "faint",
                )
            )
            return
        earlier = names[-2] if names[-1] == CALIBRATION else names[0]
        self._first = self._kept_choice("Earlier", names, earlier)
        self._second = self._kept_choice(
            "Later", names, next(n for n in reversed(names) if n != self._first.value)
        )
        self.window.button("Compare", self._compare, main=True)

    def _kept_choice(self, label: str, names: tuple[str, ...], default: str) -> viser.GuiDropdownHandle[str]:
        """A choice of a calibration that a restart keeps."""
        name, choices = f"compare.{label}", self.window.choices
        field = self.window.gui.add_dropdown(label, names, initial_value=choices.among(name, names, default))

        def chosen_another() -> None:
            choices.put(name, field.value)
            self._clear()

        field.on_update(lambda _: self.window.post(chosen_another))
        return field

    def _pair(self) -> tuple[object, ...]:
        """The two calibrations, and when they were written."""
        folder, names = self.window.project.folder, (self._first.value, self._second.value)
        return tuple((name, (folder / name / RESULTS).stat().st_mtime_ns) for name in names)

    def _show_again(self) -> None:
        """The comparison that was made last, where both calibrations are still there; computed anew where they have changed."""
        if len(self._names) < 2 or self._chosen() != self.window.choices.get("compared", [""]):
            return
        if self._kept is not None and self._kept[0] == self._pair():
            self._show(self._kept[1])
        else:
            self._compare()

    def _chosen(self) -> list[str]:
        return [self._first.value, self._second.value]

    def _clear(self) -> None:
        """Remove a comparison that is not of the two that are chosen."""
        self._remove_arrows()
        self.window.choices.put("compared", [""])
        self.window.figures.clear()
        with self._result.anew():
            pass

    def _remove_arrows(self) -> None:
        if self._arrows is not None:
            self._arrows.remove()
            self._arrows = None

    def _keep(self) -> None:
        self.window.say(f"kept as {keep_calibration(self.window.project)}", "good")
        self.refresh()

    def _compare(self) -> None:
        """Compute the comparison beside the window's thread, which shows it."""
        from flexcal.jobs.pages import folder_comparison

        folder = self.window.project.folder
        first, second = folder / self._first.value, folder / self._second.value
        stamp, pair = self._stamp, self._pair()

        def work() -> None:
            try:
                comparison = folder_comparison(first, second, self.window.project.robot_file)
            except FlexcalError as problem:
                sentence = f"{problem} [{problem.code}]"
                self.window.post(lambda: self.window.say(sentence, "bad"))
                return
            self.window.post(lambda: compared(comparison))

        def compared(comparison: Comparison) -> None:
            self._kept = pair, comparison
            if stamp is self._stamp and pair == self._pair():
                self.window.choices.put("compared", self._chosen())
                self._show(comparison)

        self.window.say("comparing …")
        threading.Thread(target=work, daemon=True).start()

    def _show(self, comparison: Comparison) -> None:
        from flexcal.report.pages import comparison_page

        window = self.window
        window.say("")
        self._remove_arrows()
        page = comparison_page(comparison)
        with self._result.anew():
            window.gui.add_html(heading(page.title))
            if comparison.change is None:
                window.gui.add_html(paragraph(comparison.no_change_why, "faint"))
                add_verdict(window.gui, page)
            else:
                changed = comparison.change.changed
                window.gui.add_html(paragraph(comparison.verdict, "warning" if changed else "good"))
                window.gui.add_html(paragraph(_next(comparison.second.name) if changed else _UNCHANGED))
                window.gui.add_html(step_link("Verify", "verify with fresh poses"))
                self._add_displacement(comparison)
                add_verdict(window.gui, page, below="Which calibration is more accurate")
            add_sections(window.gui, page)
            line = command_line(("report", comparison.first.name, "--compare", comparison.second.name))
            window.gui.add_html(paragraph("the same as a page:", "faint") + command_text(f"$ {line}"))
        window.figures.show(figure_tab(window, page.figures))

    def _add_displacement(self, comparison: Comparison) -> None:
        change = comparison.change
        assert change is not None
        sizes = change.distance / MILLIMETRE
        where = int(np.argmax(sizes))
        place = ", ".join(f"{v:.0f}" for v in change.points[where] / MILLIMETRE)
        largest = f"{np.max(sizes):.3f} ± {change.std[where] / MILLIMETRE:.3f} mm at most (1σ)"
        told = (
            f"The tool moved by {np.mean(sizes):.3f} mm in the mean and {largest}, at ({place}) mm of the base frame,"
            if change.changed
            else f"The two differ in the tool's position by {np.mean(sizes):.3f} mm in the mean and {largest}, as chance explains,"
        )
        scope = f"over {len(sizes)} random poses within the joint ranges of both. A motion of the whole robot against the instrument"
        self.window.gui.add_html(paragraph(f"{told} {scope} is taken out."))
        self._arrows = MagnifiedArrows(self.window, change.distance, 5000)
        self._arrows.show(change.points, change.displacement)


def _next(later: str) -> str:
    return (
        f"Next: go on with {later}, or measure and calibrate anew; verify with fresh poses, and export the robot "
        "and correct the commands again: those of the earlier calibration are of the robot as it was."
    )
