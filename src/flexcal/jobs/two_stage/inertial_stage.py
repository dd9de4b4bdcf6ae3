"""Stage 0 of the demonstration: link inertials, rotors and friction from exciting trajectories."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from flexcal.data.experiments import Cell
from flexcal.data.plans import write_plan
from flexcal.estimation import Estimate
from flexcal.files.formats import provenance, write_estimates
from flexcal.jobs.experiments import exciting_plan
from flexcal.jobs.inertials import identify_inertials
from flexcal.jobs.result_files import ESTIMATES
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress


def run_stage_zero(cell: Cell, nominal: RobotModel, out: Path, *, seed: int, progress: Progress) -> Estimate:
    """Design trajectories without payload, record them, and identify with robot.yaml's prior; the block `dynamics` is stored in `out`.

    Leaves trajectory_plan.yaml and estimates.yaml.
    """
    progress("dynamics", 0.0)
    plan = exciting_plan(nominal, seed=seed)
    file = out / "trajectory_plan.yaml"
    write_plan(file, plan)
    estimate = identify_inertials(nominal, plan, cell.record(plan), progress=progress).estimate
    origin = provenance([nominal.path, nominal.urdf, file], {"seed": seed})
    estimate = replace(estimate, provenance=origin)
    write_estimates(out / ESTIMATES, "dynamics", estimate)
    return estimate
