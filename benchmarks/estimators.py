"""Every estimator of dynamics on the TX40: error of the torques in the fit and held out, processor time; with friction chosen and classic.

The ratio is the held-out error of weighted least squares over that of the estimator: above one is better.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from flexcal.errors import FlexcalError
from flexcal.workflow.estimators import ESTIMATORS, EstimatorName
from flexcal.workflow.identify_dynamics import identify_robot_dynamics

EXAMPLE = Path(__file__).parents[1] / "examples" / "tx40"
HOLD_OUT = 0.3


def run() -> Iterator[tuple[str, float, str]]:
    """A row an estimator; one that refuses this recording says why."""
    with tempfile.TemporaryDirectory() as name:
        robot = Path(shutil.copytree(EXAMPLE, Path(name) / "example")) / "robot.yaml"
        chosen = robot.read_text()
        classic = chosen.replace("decimation: 100", "decimation: 100, friction: classic")
        for friction, text in (("chosen", chosen), ("classic", classic)):
            robot.write_text(text)
            least = _errors("wls", robot)[1]
            for estimator in ESTIMATORS:
                label = f"TX40, {friction} friction: {estimator}"
                try:
                    train, held_out, seconds = _errors(estimator, robot)
                except FlexcalError as problem:
                    yield label, float("nan"), f"refused: {str(problem).replace(str(robot.parent), '…')}"
                else:
                    note = f"fit {train:.2f} %, held out {held_out:.2f} %, {seconds:.2f} s of one processor"
                    yield label, least / held_out, note


def _errors(estimator: EstimatorName, robot: Path) -> tuple[float, float, float]:
    """Percent of the norm of the torques, in the fit and held out, and the processor's seconds for all of it."""
    started = time.process_time()
    out = robot.parent / estimator
    found = identify_robot_dynamics(
        robot, [robot.parent / "exciting.parquet"], hold_out=HOLD_OUT, estimator=estimator, out=out
    )
    seconds = time.process_time() - started
    percent = found.document()["error_percent"]
    return percent["train"], percent["held_out"], seconds
