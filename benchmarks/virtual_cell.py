"""How much faster than real time the virtual cell runs a frequency experiment, both cores used."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from flexcal.files.formats import read_yaml
from flexcal.jobs.experiments import frequency_plan
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell import CellConfig, VirtualCell, draw_truth

FOLDER = Path(__file__).parent.parent / "examples" / "tx90l"


def run() -> list[tuple[str, float, str]]:
    """Real time over computing time of one pose of the default plan (384 s of excitation, 0.25 ms steps)."""
    nominal = RobotModel.from_yaml(FOLDER / "robot.yaml", estimates=False)
    config = read_yaml(FOLDER / "cell.yaml", CellConfig)
    truth = draw_truth(nominal, config.spread, np.random.default_rng(0))
    plan = frequency_plan(nominal, FOLDER / "frequency_poses.csv", "default", 0)
    plan = replace(plan, poses=plan.poses[:1])
    simulated = plan.duration * plan.recordings_per_pose
    results = []
    for threads in (1, 2):
        cell = VirtualCell(nominal.with_values(truth), config, 0, controller_model=nominal, threads=threads)
        started = time.perf_counter()
        for _ in cell.record(plan):
            pass
        seconds = time.perf_counter() - started
        results.append(
            (
                f"virtual cell, real time, {threads} thread(s)",
                simulated / seconds,
                f"{simulated:.0f} s in {seconds:.2f} s",
            )
        )
    return results
