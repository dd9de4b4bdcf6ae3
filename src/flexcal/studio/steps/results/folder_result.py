"""The result of a command in the window, as its folder has it."""

from __future__ import annotations

from collections.abc import Callable

from flexcal.errors import FlexcalError
from flexcal.jobs.result_files import RESULTS
from flexcal.studio.steps.results.residuals_view import ResidualsView
from flexcal.studio.steps.results.result_source import ResultSource
from flexcal.studio.window import (
    Place,
    Window,
    add_sections,
    add_verdict,
    figure_tab,
    file_link,
    heading,
    paragraph,
)


class FolderResult:
    """Verdict, residuals, sections and figures of the report of a folder.

    Parameters
    ----------
    window : Window
        Where it is shown, at the current place of its GUI.
    """

    def __init__(self, window: Window):
        self._window = window
        self._place = Place(window.gui)
        self._residuals: ResidualsView | None = None

    def show(self, name: str | None, add_note: Callable[[], None] | None = None, *, chosen: str = "") -> None:
        """Show the result in the project's folder `name`, if there is one, in place of that before.

        `add_note` adds what stands above. Where the result is not of the table `chosen`, a warning says so.
        """
        from flexcal.jobs.pages import folder_page

        window = self._window
        self.close()
        window.figures.clear()
        with self._place.anew():
            if name is None or not (window.project.folder / name / RESULTS).is_file():
                return
            folder = window.project.folder / name
            try:
                page = folder_page(folder)
            except FlexcalError as problem:
                window.gui.add_html(paragraph(window.project.told(str(problem)), "bad"))
                return
            if add_note is not None:
                add_note()
            source = ResultSource.read(folder)
            if source is not None:
                window.gui.add_html(heading(source.title))
                difference = source.difference(window.project.folder, chosen) if chosen else ""
                if difference:
                    window.gui.add_html(paragraph(difference, "warning"))
            window.gui.add_html(paragraph(page.subtitle))
            add_verdict(window.gui, page)
            if (folder / "points.csv").is_file():
                with window.gui.add_folder("Residuals"):
                    self._residuals = ResidualsView(
                        window, folder, source.stem if source is not None else name
                    )
            add_sections(window.gui, page)
            window.gui.add_html(file_link(f"{name}/report.html", "open the report"))
        figures: dict[str, Callable[[], object]] = {}
        if self._residuals is not None:
            figures["Poses"] = self._residuals.add_course
        window.figures.show(figures | figure_tab(window, page.figures))

    def refresh(self) -> None:
        """Show the selected pose."""
        if self._residuals is not None:
            self._residuals.refresh()

    def close(self) -> None:
        """Remove the residual arrows."""
        if self._residuals is not None:
            self._residuals.close()
            self._residuals = None
