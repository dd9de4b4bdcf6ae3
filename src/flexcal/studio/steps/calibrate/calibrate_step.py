"""Identification and calibration, stage by stage."""

from __future__ import annotations

from flexcal.jobs.result_files import RESULTS
from flexcal.studio.commands import command_line
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
from flexcal.studio.steps.results import FolderResult
from flexcal.studio.window import Place, Step, Tone, Window, paragraph

_NONE = "none"
_TONES: dict[State, Tone] = {"done": "good", "outdated": "warning", "ready": "plain", "blocked": "faint"}


class CalibrateStep(Step):
    """Identification and calibration, stage by stage: what the data tell, and what not."""

    title = "Calibrate"

    def __init__(self, window: Window):
        super().__init__(window)
        self._shown: object = None
        self._stage = window.choices.get("stage", "Geometry")

    def open(self) -> None:
        """Add the choice of measured poses, a line and a button a stage, and the result of one of them."""
        window, gui = self.window, self.window.gui
        self._shown = None
        names = pose_files(window.project) or [_NONE]
        self._measured = gui.add_dropdown(
            "Measured poses", names, initial_value=window.choices.among("measured", names)
        )
        self._measured.on_update(lambda _: window.post(self._choose))
        self._place = Place(gui)
        self._result = FolderResult(window)

    def refresh(self) -> None:
        """Show the stages as the folder has them; the result where it has changed."""
        project = self.window.project
        chosen = "" if self._measured.value == _NONE else self._measured.value
        shown = (project.stamp(), chosen, self._stage, self.window.dark)
        if shown != self._shown:
            self._shown = shown
            listed = stages(project, chosen)
            self._list(listed)
            finished = {s.title: s.folder for s in listed if (project.folder / s.folder / RESULTS).is_file()}
            # that of the stage that ran last, else of the last one that is there
            title = self._stage if self._stage in finished else next(reversed(finished), None)
            folder = None if title is None else finished[title]
            self._result.show(
                folder,
                lambda: self._add_choice(tuple(finished), title),
                chosen=chosen if folder == CALIBRATION else "",
            )
        self._result.refresh()

    def close(self) -> None:
        """Remove the residual arrows."""
        self._result.close()

    def _choose(self) -> None:
        self.window.choices.put("measured", self._measured.value)
        self.refresh()

    def _list(self, listed: list[Stage]) -> None:
        with self._place.anew():
            for stage in listed:
                self.window.gui.add_html(paragraph(f"{stage.title}: {stage.sentence}", _TONES[stage.state]))
                if stage.folder in (INERTIALS, STIFFNESS) and stage.state == "done":
                    self._add_use(stage)
                if stage.state != "blocked":
                    again = " again" if stage.state in ("done", "outdated") else ""
                    self.window.button(
                        f"{'Calibrate' if stage.folder == CALIBRATION else 'Identify'}{again}: {stage.title.lower()}",
                        lambda stage=stage: self._run(stage),
                        hint=f"$ {command_line(stage.arguments)}",
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

    def _add_choice(self, titles: tuple[str, ...], title: str | None) -> None:
        """A choice of the stage whose result is shown, where there are several."""
        if title is None or len(titles) < 2:
            return
        choice = self.window.gui.add_dropdown("Result of", titles, initial_value=title)

        def chosen() -> None:
            self._stage = choice.value
            self.window.choices.put("stage", self._stage)
            self.refresh()

        choice.on_update(lambda _: self.window.post(chosen))
