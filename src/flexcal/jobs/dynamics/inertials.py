"""Identification of link inertials, rotors and friction with CAD as the prior, and estimates.yaml."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flexcal.data.experiments import PLAN, FolderCell, existing_file, labels
from flexcal.data.plans import TrajectoryPlan
from flexcal.data.recordings import Recording
from flexcal.dynamics.inertials import identify_with_prior, trajectory_error
from flexcal.dynamics.signals import LogFaults, external_torque
from flexcal.errors import InputError
from flexcal.estimation import Estimate
from flexcal.files.formats import provenance, read_estimates
from flexcal.jobs.result_files import estimates_target, header, quantities, store_block, write_results
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust
from flexcal.report.pages import inertials_checks

_SENSELESS = 0.5
"""Share of the torques that no robot misses whose torques they are."""


@dataclass(frozen=True, eq=False)
class RobotInertials:
    """The robot before, the estimate, what the torques of either miss (shares of their norm), its file, and the command line."""

    nominal: RobotModel
    estimate: Estimate
    trajectories: int
    nominal_error: float
    error: float
    estimates: Path
    command: str = ""

    @property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(inertials_checks(self._numbers, self.estimate))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {**header("inertials"), **self._numbers, "verdict": self.trust.document()}

    @property
    def _numbers(self) -> dict[str, Any]:
        return {
            "robot": self.nominal.name,
            "trajectories": self.trajectories,
            "error_percent": {"nominal": 100 * self.nominal_error, "train": 100 * self.error},
            "parameters": quantities(self.estimate),
            "estimates": self.estimates,
            "command": self.command,
        }


def identify_robot_inertials(
    robot: Path, folder: Path, *, out: Path | None = None, command: str = "", progress: Progress = silent
) -> RobotInertials:
    """Fit link inertials, rotors and friction of a robot.yaml to the trajectories in `folder`, and store the block `dynamics`.

    `folder` holds the plan and its logs, as 'measure' leaves them. The robot starts from nominal with the tolerances of its `prior:`: the
    other blocks began from this one, and are kept. With `out`, estimates, results.json and report.html go to that folder. Raises
    `FlexcalError` where the folder does not hold trajectories of this robot; nothing is written then.
    """
    nominal = RobotModel.from_yaml(robot, estimates=False)
    source = nominal.path.parent / nominal.config.estimates
    target = estimates_target(source, out, "dynamics")
    cell = FolderCell(folder, nominal)
    plan = cell.plan
    if not isinstance(plan, TrajectoryPlan):
        verb = "identify response" if plan.kind == "multisine" else "calibrate"
        raise InputError(
            "E-RUN-035",
            f"{folder / PLAN} is a plan of kind '{plan.kind}', not of trajectories; give the folder to 'flexcal {verb}'.",
        )
    files = [existing_file(folder, label.name) for label in labels(plan)]
    recordings, estimate = identify_inertials_from_recordings(
        nominal, plan, _checked(cell.record(plan), files, nominal), progress
    )
    error = trajectory_error(nominal.with_estimate(estimate), plan, recordings)
    if error > _SENSELESS:
        raise InputError(
            "E-RUN-036",
            f"{folder}: the relative torque error of the fit is {100 * error:.0f} %, so the torques are not those of this robot's joints "
            f"in N m; check "
            "signs, units and gear ratios under `signals:`.",
        )
    origin = provenance([robot, nominal.urdf, folder / PLAN, *files], {})
    estimate = replace(estimate, provenance=origin)
    before = trajectory_error(nominal, plan, recordings)
    inertials = RobotInertials(nominal, estimate, len(plan), before, error, target, command)
    others = read_estimates(source, without="dynamics") if source.exists() else {}
    store_block(source, target, others, "dynamics", estimate)
    if out is not None:
        from flexcal.jobs.pages import report_folder

        write_results(out, inertials.document())
        report_folder(out)
    return inertials


def identify_inertials_from_recordings(
    nominal: RobotModel, plan: TrajectoryPlan, recordings: Iterable[Recording], progress: Progress
) -> tuple[Sequence[Recording], Estimate]:
    """The recordings of a plan as they come, and what they tell of a robot with its own prior."""
    progress("dynamics", 0.0)
    recorded = []
    for number, recording in enumerate(recordings, start=1):
        recorded.append(recording)
        progress("dynamics", 0.7 * number / len(plan))
    estimate = identify_with_prior(nominal, plan, recorded)
    progress("dynamics", 1.0)
    return recorded, estimate


def _checked(
    recordings: Iterable[Recording], files: Sequence[Path], model: RobotModel
) -> Iterator[Recording]:
    """The recordings of some files, their torques τ + τ_ext; raises `InputError` for the first that lies."""
    for recording, file in zip(recordings, files, strict=True):
        faults = LogFaults(file, model)
        faults.add(recording)
        faults.check()
        outside = external_torque(model, recording)
        yield recording if outside is None else replace(recording, torque=recording.torque + outside)
