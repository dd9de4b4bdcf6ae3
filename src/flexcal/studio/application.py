"""The studio of a folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path


def run_studio(folder: Path, host: str, port: int | None, ready: Callable[[str], None]) -> None:
    """Serve the studio of a folder until it is interrupted.

    Parameters
    ----------
    folder : Path
        The project's folder; it may be empty.
    host : str
        Address to listen on.
    port : int or None
        Port; None for the first free one from 8080.
    ready : callable
        Called with the URL, which has the token.

    Raises
    ------
    InputError
        For a folder that is not there, and where nothing can listen at the address.
    """
    import viser

    from flexcal.studio.project import Project
    from flexcal.studio.steps import CalibrateStep, CompareStep, MeasureStep, PlanStep, RobotStep, VerifyStep
    from flexcal.studio.window import Window

    project = Project.open(folder)
    server = viser.ViserServer(host=host, port=port or 8080, verbose=False)
    window = Window(
        server, project, [RobotStep, PlanStep, MeasureStep, CalibrateStep, VerifyStep, CompareStep]
    )
    ready(f"http://{host}:{server.get_port()}/")
    try:
        window.run()
    finally:
        window.stop()
        server.stop()
