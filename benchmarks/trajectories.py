"""Exciting trajectories against figaroh's and against the best of many random ones, of three robots, all judged by one evaluator.

`python -m benchmarks.trajectories --robots ur10 panda --first 0 --count 3 --seconds 60`

All move the same arm (rigid, drives unknown) for the same time within the limits of its URDF. figaroh has ten times the processor time,
knows nothing of the floor, which only leaves it more room, and gets what its optimiser leaves unfinished counted.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import hashlib
import json
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from benchmarks._judge import Judge
from benchmarks._random_trajectories import INSTANTS, fourier_motion, random_trajectories
from benchmarks.peers import ENVIRONMENTS, HERE, environment, run_peer
from flexcal.design.trajectories import TrajectoryCriterion, optimise_trajectories
from flexcal.model.robot import RobotModel

DURATION, HARMONICS, RANDOM = 10.0, 5, 1000
SECONDS = 200.0
"""Processor time of figaroh, ten times the 20 s that flexcal may take."""
SEEDS = range(10)
FIGAROH = "figaroh_trajectory.py"
REQUIREMENTS = ("figaroh==1.0.2", "example-robot-data==6.0.0", "casadi==3.8.2")
COMPILED = ("cyipopt==1.7.0",)
URDFS = {
    "tx90l": Path(__file__).parents[1] / "examples" / "tx90l" / "tx90l.urdf",
    "ur10": Path("ur_description", "urdf", "ur10_robot.urdf"),
    "panda": Path("panda_description", "urdf", "panda.urdf"),
}
LOCKED = {"panda": {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}}
FINE_HZ, COARSER = 1000, 10
"""Limits are checked on all samples, information is counted on every tenth."""
TIME = np.arange(round(DURATION * FINE_HZ)) / FINE_HZ


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one run of one competitor gave: cond(W), log det(WᵀW / N), processor time (s), broken limits, and what it says of itself."""

    condition: float
    log_det: float
    seconds: float
    broken: dict[str, float]
    remark: str = ""

    @classmethod
    def judged(cls, judge: Judge, motion: np.ndarray, seconds: float, remark: str = "") -> Outcome:
        """Of a motion q, q̇, q̈ (3, N, n) at `TIME`."""
        return cls(*judge.merits(motion[:, ::COARSER]), seconds, judge.violations(motion), remark)


def run() -> list[tuple[str, float, str]]:
    """The whole comparison."""
    return list(collect(list(URDFS), SEEDS, SECONDS))


def collect(robots: list[str], seeds: range, seconds: float) -> Iterator[tuple[str, float, str]]:
    """Robot by robot and competitor by competitor, medians over the seeds.

    The ratio is another's cond(W) over ours, and how many times more ours tells of a base parameter, as a geometric mean.
    """
    for robot in robots:
        with tempfile.TemporaryDirectory() as folder:
            judge = Judge(load(robot, Path(folder)))
            conditioned = [flexcal(judge, "condition", seed) for seed in seeds]
            informed = [flexcal(judge, "D", seed) for seed in seeds]
            random = [best_random(judge, seed) for seed in seeds]
            outcomes = {
                "flexcal, condition": conditioned,
                "flexcal, D": informed,
                "figaroh": [figaroh(judge, robot, seed, seconds) for seed in seeds],
                f"best cond of {RANDOM} random": [best for best, _ in random],
                f"best log det of {RANDOM} random": [best for _, best in random],
            }
        least, most = median(conditioned, "condition"), median(informed, "log_det")
        for name, runs in outcomes.items():
            condition, told = median(runs, "condition"), median(runs, "log_det")
            yield f"{robot}, {name}: cond(W)", condition / least, f"{condition:.1f} {spread(runs)}"
            yield (
                f"{robot}, {name}: information",
                float(np.exp((most - told) / judge.base.rank)),
                f"log det {told:.1f}; {remarks(runs)}",
            )


def median(outcomes: list[Outcome], what: str) -> float:
    """Over the seeds."""
    return float(np.median([getattr(outcome, what) for outcome in outcomes]))


def spread(runs: list[Outcome]) -> str:
    """Least and largest condition number."""
    conditions = [run.condition for run in runs]
    return f"({min(conditions):.1f} to {max(conditions):.1f} on {len(runs)} seeds)"


def remarks(runs: list[Outcome]) -> str:
    """Processor time, broken limits, and what else is to be said."""
    broken = [f"{name} {size:.3g}" for run in runs for name, size in run.broken.items()]
    said = [run.remark for run in runs if run.remark]
    return "; ".join([f"{median(runs, 'seconds'):.1f} s", ", ".join(broken) or "keeps all limits", *said])


def load(robot: str, folder: Path) -> RobotModel:
    """A robot from its own URDF, a small robot.yaml written into `folder`; nothing is known of its drives, and it holds nothing."""
    urdf = shared() / "robots" / URDFS[robot]
    locked = ", ".join(f"{joint}: {position}" for joint, position in LOCKED.get(robot, {}).items())
    (folder / "robot.yaml").write_text(f"robot: {urdf}\nlocked: {{{locked}}}\n")
    return RobotModel.from_yaml(folder / "robot.yaml")


def shared() -> Path:
    """Where example-robot-data lies in figaroh's environment."""
    home = environment(FIGAROH, REQUIREMENTS, compiled=COMPILED)
    return next(home.glob("lib/python*/site-packages/cmeel.prefix/share/example-robot-data"))


def figaroh(judge: Judge, robot: str, seed: int, seconds: float) -> Outcome:
    """Its trajectory with a seed. Runs are kept beside its environment, as they take long."""
    request = {
        "urdf": str(judge.model.urdf),
        "packages": str(shared().parent),
        "locked": list(judge.model.config.locked),
        "pairs": judge.itself.pairs,
        "duration": DURATION,
        "seed": seed,
        "seconds": seconds,
    }
    script = hashlib.sha256((HERE / FIGAROH).read_bytes()).hexdigest()[:8]
    kept = ENVIRONMENTS / "figaroh_trajectories" / f"{robot}_{seed}_{seconds:g}_{script}.json"
    if not kept.exists():
        found = run_peer(FIGAROH, REQUIREMENTS, request, compiled=COMPILED)
        kept.parent.mkdir(exist_ok=True)
        kept.write_text(json.dumps(found))
    found = json.loads(kept.read_text())
    if found["motion"] is None:
        return Outcome(
            np.inf, -np.inf, found["seconds"], {}, f"seed {seed}: none in {found['attempts']} attempts"
        )
    remark = f"seed {seed}: {'converged' if found['answer'] else 'best feasible iterate'}"
    return Outcome.judged(judge, np.array(found["motion"]), found["seconds"], remark)


def best_random(judge: Judge, seed: int) -> tuple[Outcome, Outcome]:
    """The best by condition and the best by log det, of those that keep all limits at all samples."""
    started = time.process_time()
    endless = random_trajectories(judge.model, DURATION, HARMONICS, np.random.default_rng(seed))
    drawn = list(islice(endless, RANDOM))
    coarse = np.arange(INSTANTS) * DURATION / INSTANTS
    merits = np.array([judge.merits(fourier_motion(*one, DURATION, coarse)) for one in drawn])
    seconds = time.process_time() - started
    ranked = (
        (Outcome.judged(judge, fourier_motion(*drawn[int(k)], DURATION, TIME), seconds) for k in order)
        for order in (np.argsort(merits[:, 0]), np.argsort(-merits[:, 1]))
    )
    by_condition, by_log_det = (next(one for one in each if not one.broken) for each in ranked)
    return by_condition, by_log_det


def flexcal(judge: Judge, criterion: TrajectoryCriterion, seed: int) -> Outcome:
    """Ours with a seed."""
    started = time.process_time()
    design = optimise_trajectories(
        judge.model, criterion=criterion, duration=DURATION, harmonics=HARMONICS, seed=seed
    )
    seconds = time.process_time() - started
    return Outcome.judged(judge, np.array(design.plan.motion(0, TIME)), seconds)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", nargs="+", choices=list(URDFS), default=list(URDFS))
    parser.add_argument("--first", type=int, default=SEEDS.start)
    parser.add_argument("--count", type=int, default=len(SEEDS))
    parser.add_argument("--seconds", type=float, default=SECONDS, help="processor time of a run of figaroh")
    given = parser.parse_args()
    for label, ratio, note in collect(
        given.robots, range(given.first, given.first + given.count), given.seconds
    ):
        print(f"{label:48s} {ratio:8.2f}   {note}", flush=True)
