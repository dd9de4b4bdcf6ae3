"""Identification and calibration, stage by stage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from flexcal.errors import FlexcalError
from flexcal.jobs.result_files import RESULTS
from flexcal.studio.project import CALIBRATION, pose_files
from flexcal.studio.steps.calibrate.stages import (
    INERTIALS,
    STIFFNESS,
    Stage,
    State,
    stages,
    use_estimates,
    used_estimates,
)
from flexcal.studio.steps.residuals import ResidualsView
from flexcal.studio.window import ReportFigures, Step, Tone, Window, add_sections, add_verdict, paragraph

if TYPE_CHECKING:
    pass

if TYPE_CHECKING:
    from flexcal.report.layout import FigureBlock

_NONE = "none"
_TONES: dict[State, Tone] = {"done": "good", "ready": "plain", "blocked": "faint"}


class CalibrateStep(Step):
    """Identification and calibration, stage by stage: what the data tell, and what not."""

    title = "Calibrate"

    def __init__(self, window: Window):
        super().__init__(window)
        self._residuals: ResidualsView | None = None
        self._shown: object = None
        self._stage = window.choices.get("stage", "Geometry")

    def open(self) -> None:
        """Add the choice of measured poses, a line and a button a stage, and the result of one of them."""
        window, gui = self.window, self.window.gui
        self._shown = None
        names = pose_files(window.project)
        chosen = window.choices.get("measured", names[0] if names else _NONE)
        self._measured = gui.add_dropdown(
            "Measured poses",
            names or [_NONE],
            initial_value=chosen if chosen in names else (names or [_NONE])[0],
        )
        self._measured.on_update(lambda _: window.post(self._choose))
        self._place = gui.add_folder(None)
        self._result = gui.add_folder(None)

    def refresh(self) -> None:
        """Show the stages as the folder has them; the result where it has changed."""
        project = self.window.project
        listed = stages(project, "" if self._measured.value == _NONE else self._measured.value)
        stamp = project.stamp()
        if (stamp, listed, self._stage, self.window.dark) != self._shown:
            self._shown = (stamp, listed, self._stage, self.window.dark)
            self._list(listed)
            self._show_result()
        if self._residuals is not None:
            self._residuals.refresh()

    def close(self) -> None:
        """Remove the residual arrows."""
        if self._residuals is not None:
            self._residuals.close()
            self._residuals = None

    def _choose(self) -> None:
        self.window.choices.put("measured", self._measured.value)
        self.refresh()

    def _list(self, listed: list[Stage]) -> None:
        order = self._place.order
        self._place.remove()
        self._place = self.window.gui.add_folder(None, order=order)
        with self._place:
            for stage in listed:
                self.window.gui.add_html(paragraph(f"{stage.title}: {stage.sentence}", _TONES[stage.state]))
                if stage.folder in (INERTIALS, STIFFNESS) and stage.state == "done":
                    self._add_use(stage)
                if stage.state != "blocked":
                    again = " again" if stage.state == "done" else ""
                    self.window.button(
                        f"{'Calibrate' if stage.folder == CALIBRATION else 'Identify'}{again}: {stage.title.lower()}",
                        lambda stage=stage: self._run(stage),
                        hint="$ flexcal " + " ".join(stage.arguments),
                        main=stage.folder == CALIBRATION,
                    )

    def _add_use(self, stage: Stage) -> None:
        """A button that makes the following stages begin with these estimates, or that they do."""
        file = f"{stage.folder}/estimates.yaml"
        if used_estimates(self.window.project) == file:
            self.window.gui.add_html(paragraph("the following stages begin with these estimates", "faint"))
            return
        self.window.button(
            f"Use: {stage.title.lower()}",
            lambda: use_estimates(self.window.project, file),
            hint=f"writes 'estimates: {file}' to robot.yaml, which the following stages read",
        )

    def _run(self, stage: Stage) -> None:
        self._stage = stage.title
        self.window.choices.put("stage", stage.title)
        self.window.command(stage.arguments)

    def _show_result(self) -> None:
        from flexcal.jobs.pages import folder_page

        window, order = self.window, self._result.order
        self.close()
        window.figures.clear()
        self._result.remove()
        self._result = window.gui.add_folder(None, order=order)
        folder = self._folder()
        if folder is None:
            return
        with self._result:
            try:
                page = folder_page(window.project.folder / folder)
            except FlexcalError as problem:
                window.gui.add_html(paragraph(str(problem), "bad"))
                return
            self._add_choice(folder)
            window.gui.add_html(paragraph(page.subtitle))
            add_verdict(window.gui, page)
            if folder == CALIBRATION and (window.project.folder / folder / "points.csv").is_file():
                with window.gui.add_folder("Residuals"):
                    self._residuals = ResidualsView(window, window.project.folder / folder)
            add_sections(window.gui, page)
            window.gui.add_html(
                f'<a href="files/{folder}/report.html" target="_blank" rel="noopener" style="margin:0.5em;font-size:0.85em;">'
                "open the report</a>"
            )
        figures = {} if self._residuals is None else {"Poses": self._residuals.add_course}
        if page.figures:
            figures["Figures"] = lambda: self._add_figures(page.figures)
        window.figures.show(figures)

    def _add_figures(self, blocks: Sequence[FigureBlock]) -> None:
        self._figures = ReportFigures(self.window.gui, blocks, dark=self.window.dark)

    def _add_choice(self, folder: str) -> None:
        """A choice of the stage whose result is shown, where there are several."""
        found = {stage.title: stage.folder for stage in self._with_results()}
        if len(found) < 2:
            return
        here = next(title for title, place in found.items() if place == folder)
        choice = self.window.gui.add_dropdown("Result of", tuple(found), initial_value=here)

        def chosen() -> None:
            self._stage = choice.value
            self.window.choices.put("stage", self._stage)
            self.refresh()

        choice.on_update(lambda _: self.window.post(chosen))

    def _folder(self) -> str | None:
        """Folder of the result to show: of the stage that ran last, else of the last one that is there."""
        found = self._with_results()
        return next((s.folder for s in found if s.title == self._stage), found[-1].folder if found else None)

    def _with_results(self) -> list[Stage]:
        folder = self.window.project.folder
        return [s for s in stages(self.window.project, "") if (folder / s.folder / RESULTS).is_file()]
