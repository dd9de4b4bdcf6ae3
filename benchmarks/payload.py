"""An unknown payload of the virtual robot, of many hidden truths: errors of what one short trajectory tells, intervals, and the tool.

`python -m benchmarks.payload --first 20 --count 10`: the payload weighs a fifth more or less than robot.yaml declares and hangs some 20 mm
elsewhere. The robot's own dynamics are those of stage 0 ("block"), or are fitted to the same recordings without payload ("free").
`--substeps 8` steps the simulation eight times a sample: fits see the error of cell.yaml's 4 kHz, 0.05 N m at the first two joints.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._tasks import in_parallel
from flexcal.compensation import motor_commands
from flexcal.data.plans import write_plan
from flexcal.data.poses import ToolTargets
from flexcal.design.poses import random_poses
from flexcal.design.scene import MeasuringSetup
from flexcal.estimation import Estimate
from flexcal.files.formats import read_yaml
from flexcal.jobs.experiments import TrajectoryRequest, measure
from flexcal.jobs.experiments.measurement import VIRTUAL
from flexcal.jobs.inertials import identify_robot_inertials
from flexcal.jobs.payload import identify_robot_payload
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest
from flexcal.units import MILLIMETRE
from flexcal.virtual_cell import CellConfig, draw_truth, write_truth

EXAMPLE = Path(__file__).parent.parent / "examples" / "tx90l"
TARGETS = 60
PLANS = {
    "free": TrajectoryRequest(),
    "loaded": TrajectoryRequest(count=1, criterion="c", of=("payload.mass",), duration=5.0),
}
BODY = {"Ixx": 0.05, "Ixy": 0.0, "Ixz": 0.0, "Iyy": 0.04, "Iyz": 0.0, "Izz": 0.03}


def design(folder: Path) -> None:
    """The plans, the same for all seeds, where they are not there yet."""
    nominal = RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False)
    for name, request in PLANS.items():
        if not (folder / f"{name}.yaml").exists():
            write_plan(folder / f"{name}.yaml", request.optimise(nominal)[0].plan)


def truth_of(nominal: RobotModel, seed: int) -> dict[str, float]:
    """A hidden robot, and what it holds: kg, m, kg m²."""
    spread = read_yaml(EXAMPLE / "cell.yaml", CellConfig).spread
    rng = np.random.default_rng([seed, 77])
    values = draw_truth(nominal, spread, np.random.default_rng([seed, 0]))
    values["payload.mass"] = nominal.value("payload.mass") * (1.2 if seed % 2 else 0.8)
    for key in "xyz":
        values[f"payload.com_{key}"] = nominal.value(f"payload.com_{key}") + 0.02 * rng.standard_normal()
    return values | {f"payload.{key}": value for key, value in BODY.items()}


def one_seed(seed: int, plans: Path, substeps: int = 1) -> dict[str, Any]:
    """Errors over standard deviations and intervals of either way, and the tool's errors in mm."""
    nominal = RobotModel.from_yaml(EXAMPLE / "robot.yaml", estimates=False)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name in ("robot.yaml", "tx90l.urdf", "cell.yaml"):
            shutil.copy(EXAMPLE / name, folder)
        cell = (folder / "cell.yaml").read_text("utf-8").replace("substeps: 1", f"substeps: {substeps}")
        (folder / "cell.yaml").write_text(cell, "utf-8")
        robot = folder / "robot.yaml"
        truth = truth_of(nominal, seed)
        write_truth(folder / "truth.yaml", truth)
        for name in PLANS:
            measure(
                robot,
                plans / f"{name}.yaml",
                VIRTUAL,
                folder / name,
                seed=seed,
                truth=folder / "truth.yaml",
            )
        loaded = [folder / "loaded"]
        free = identify_robot_payload(robot, loaded, free=[folder / "free"], out=folder / "out").estimate
        identify_robot_inertials(robot, folder / "free")
        block = identify_robot_payload(robot, loaded).estimate
    tool = {}
    true = nominal.with_values(truth)
    for name, values in (("declared", {}), ("block", block.values), ("free", free.values)):
        known = truth | {key: nominal.value(key) for key in truth if key.startswith("payload.")} | values
        tool[name] = _tool_error(nominal, nominal.with_values(known), true, seed)
    return {"seed": seed, "tool": tool} | {
        name: {key: _score(found, key, truth[key]) for key in found.parameters.names}
        for name, found in (("block", block), ("free", free))
    }


def _score(found: Estimate, name: str, truth: float) -> tuple[float, float | None, bool | None]:
    """Error, standard deviation and whether the interval holds the truth."""
    interval = found.interval(name)
    inside = None if interval is None else bool(interval[0] <= truth <= interval[1])
    return found.values[name] - truth, found.std(name), inside


def _tool_error(nominal: RobotModel, model: RobotModel, true: RobotModel, seed: int) -> float:
    """How far (mm, mean) the true tool is from where commands of a calibrated robot with this payload want it."""
    drawn = random_poses(nominal, TARGETS, np.random.default_rng([seed, 6]), MeasuringSetup())
    names = np.full(TARGETS, nominal.point().name)
    found = motor_commands(model, nominal, ToolTargets(np.arange(TARGETS), names, drawn.q))
    done = found.reached
    at = tool_at_rest(true, found.q[done], None, names[done]).kinematics.position
    wanted = point_kinematics(nominal, drawn.q[done], jacobians=False).position
    return float(np.linalg.norm(at - wanted, axis=1).mean()) / MILLIMETRE


def summary(runs: list[dict[str, Any]]) -> str:
    """A text table."""
    lines = [f"{len(runs)} seeds {runs[0]['seed']}..{runs[-1]['seed']}"]
    for way in ("block", "free"):
        held: list[bool] = []
        lines.append(f"{way:16s} {'rms error':>12s} {'rms std':>12s} {'rms of error/std':>18s}  inside")
        for name in runs[0][way]:
            rows = [run[way][name] for run in runs if run[way][name][1] is not None]
            if not rows:
                continue
            errors, std = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
            inside = [row[2] for row in rows]
            held += inside
            sizes = [np.sqrt(np.mean(v**2)) for v in (errors, std, errors / std)]
            lines.append(
                f"{name:16s} {sizes[0]:12.5f} {sizes[1]:12.5f} {sizes[2]:18.2f}  {sum(inside)}/{len(inside)}"
            )
        lines.append(f"95 % intervals that hold the truth: {np.mean(held):.3f} of {len(held)}")
    for name in ("declared", "block", "free"):
        values = [run["tool"][name] for run in runs]
        lines.append(
            f"tool, payload {name:9s} mean {np.median(values):.4f} mm (median of seeds), worst {max(values):.4f} mm"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=20)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--plans", type=Path, default=None, help="folder for the designed plans, kept")
    parser.add_argument("--substeps", type=int, default=1, help="of the simulation, a sample")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        plans = given.plans or Path(temporary)
        design(plans)
        seeds = range(given.first, given.first + given.count)
        print(summary(in_parallel(one_seed, seeds, plans, given.substeps, show=lambda run: run["seed"])))


if __name__ == "__main__":
    main()
