"""Stage 0 of the demonstration: link inertials, rotors and friction from exciting trajectories, before anything elastic is identified."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from flexcal.cell import VirtualCell
from flexcal.data import TrajectoryPlan, provenance, write_estimates, write_plan
from flexcal.data.experiment_folder import labels
from flexcal.design import design_trajectories
from flexcal.dynamics import identify_with_prior
from flexcal.estimation import Estimate
from flexcal.model import RobotModel
from flexcal.progress import Progress

TRAJECTORIES = 3
CANDIDATES = 60


def run_stage_zero(
    cell: VirtualCell, nominal: RobotModel, out: Path, *, seed: int, progress: Progress
) -> tuple[TrajectoryPlan, Estimate]:
    """Design trajectories without payload, record them, and identify with robot.yaml's prior; the block `dynamics` is stored in `out`.

    Leaves trajectory_plan.yaml and estimates.yaml.
    """
    progress("dynamics", 0.0)
    payload = None if nominal.payload is None else 0.0
    plan = design_trajectories(nominal, TRAJECTORIES, candidates=CANDIDATES, seed=seed, payload=payload)
    file = out / "trajectory_plan.yaml"
    write_plan(file, plan)
    recordings = []
    for number, recording in enumerate(cell.record(plan), start=1):
        recordings.append(recording)
        progress("dynamics", 0.7 * number / len(list(labels(plan))))
    estimate = identify_with_prior(nominal, plan, recordings)
    origin = provenance([nominal.path, nominal.urdf, file], {"seed": seed})
    estimate = replace(estimate, provenance=origin)
    write_estimates(out / "estimates.yaml", "dynamics", estimate)
    progress("dynamics", 1.0)
    return plan, estimate
