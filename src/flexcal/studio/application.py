"""The studio of a folder."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexcal.studio.project import Project
    from flexcal.studio.server import StudioServer


def run_studio(folder: Path, host: str, port: int | None, ready: Callable[[StudioServer], None]) -> None:
    """Serve the studio of a folder until `KeyboardInterrupt`.

    Parameters
    ----------
    folder : Path
        The project's folder; it may be empty.
    host : str
        Address to listen on.
    port : int or None
        Port; None for the first free one from 8080.
    ready : callable
        Called with the server, which has the URL, once the window can be opened.

    Raises
    ------
    FlexcalError
        Without viser, and with one that cannot be protected.
    InputError
        For a folder that is not there or that another studio has open, and where nothing can listen at the address.
    """
    from flexcal.studio.project import Project, sole_studio

    project = Project.open(folder)
    with sole_studio(project.folder):
        _serve(project, host, port, ready)


def _serve(project: Project, host: str, port: int | None, ready: Callable[[StudioServer], None]) -> None:
    from flexcal.studio.server import NO_CONTENT, Answer, ProjectFiles, Route, StudioServer, said
    from flexcal.studio.steps import CalibrateStep, CompareStep, MeasureStep, PlanStep, RobotStep, VerifyStep
    from flexcal.studio.window import Window

    # what lies too far away for the window, as in a URDF with a wrong number, is not drawn; viser need not say so in its own words
    warnings.filterwarnings("ignore", "overflow encountered in cast", RuntimeWarning)
    routes: dict[str, Route] = {}
    server = StudioServer.start(host, port, routes, ProjectFiles(project.folder))
    try:
        steps = [RobotStep, PlanStep, MeasureStep, CalibrateStep, VerifyStep, CompareStep]
        window = Window(server.viser, project, steps)

        def pick(key: str) -> Answer:
            window.post(lambda: window.selection.pick(key))
            return NO_CONTENT

        def step(title: str) -> Answer:
            window.post(lambda: window.go_to(title))
            return NO_CONTENT

        def enter(text: str) -> Answer:
            try:
                texts = json.loads(text)
            except (ValueError, RecursionError):
                texts = None
            if (
                not isinstance(texts, dict)
                or "once" not in texts
                or not all(isinstance(one, str) for one in texts.values())
            ):
                return said(400, "This is not what the form of the window sends.")
            return NO_CONTENT if window.enter(texts) else said(409, "Not taken; the window says why.")

        routes |= {"pick": pick, "step": step, "enter": enter}
        try:
            with suppress(KeyboardInterrupt):
                ready(server)
                window.run()
        finally:
            window.stop()
    finally:
        server.stop()
