"""Every estimator of dynamics on the TX40: error of the torques in the fit and held out, processor time; with friction chosen and classic.

The ratio is the held-out error of weighted least squares over that of the estimator: above one is better. The last row of either is that of
weighted least squares with a learned residual torque.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from flexcal.dynamics.estimators import ESTIMATORS, EstimatorName
from flexcal.errors import FlexcalError
from flexcal.jobs.dynamics import identify_robot_dynamics

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
            yield _with_learned(f"TX40, {friction} friction: wls with a learned residual", robot)


def _with_learned(label: str, robot: Path) -> tuple[str, float, str]:
    started = time.process_time()
    try:
        found = identify_robot_dynamics(
            robot,
            [robot.parent / "exciting.parquet"],
            hold_out=HOLD_OUT,
            learn_residual=True,
            out=robot.parent / "learned",
        )
    except FlexcalError as problem:
        return label, float("nan"), f"refused: {problem}"
    seconds = time.process_time() - started
    percent = found.document()["learned_residual"]["error_percent"]
    left_out, held_out = percent["cross_validation"], percent["held_out"]
    note = (
        f"fit {percent['train']['with']:.2f} %, held out {held_out['with']:.2f} %, blocks left out of the fit {left_out['with']:.2f} % "
        f"(without {left_out['without']:.2f} %), {seconds:.2f} s of one processor"
    )
    return label, held_out["without"] / held_out["with"], note


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
