"""How many poses, how good an instrument, what accuracy: calibrations of simulated arms of three to seven axes over poses and noise.

`python -m benchmarks.pose_grid [--arms 10] [--first 0] [--poses 6 12 …] [--noise-um 0 1 …] [--processes 2] [--each]`

Robots are of the tests' simulator, as in `few_poses`, of arms that are drawn too. Of every calibration: P90 at fresh poses beside that of
the nominal robot with base and point found from the same poses, observed over predicted errors, the verdict of `calibrate`, and that of
`verify` at 40 fresh poses read with the same noise. Told apart are the wrong ones: worse than uncalibrated by more than 5 %, a yes where
fresh errors are half as large again as predicted, and a no where they are as predicted.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one process a core below

import argparse
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks._tasks import in_parallel
from benchmarks.few_poses import FRESH, drive_compliance, observed_over_predicted, uncalibrated_p90
from flexcal import RobotModel, calibrate, read_poses, verify
from flexcal.calibration.verification import prediction_errors
from flexcal.errors import FlexcalError
from tests.jobs import yielding_robot
from tests.jobs.yielding_robot import (
    PANDA_LIKE,
    TX90L_LIKE,
    UR_LIKE,
    Body,
    YieldingRobot,
    write_robot,
)

POSES = (6, 8, 12, 20, 60, 200, 1000)
NOISES_UM = (0.0, 1.0, 20.0, 100.0, 1000.0, 3000.0)
_WORSE, _AS_PREDICTED, _MISSED = 1.05, 1.3, 1.5


@dataclass(frozen=True)
class Tried:
    """One calibration: P90, mm, before and after, observed over predicted errors, and verdicts; or why there is none."""

    arm: int
    axes: int
    poses: int
    noise_um: float
    refused: str = ""
    before: float = np.nan
    after: float = np.nan
    ratio: float = np.nan
    trust: str = ""
    verified: str = ""
    reasons: tuple[str, ...] = ()
    wide: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def faults(self) -> list[str]:
        """What is wrong with it."""
        if self.refused:
            return ["refused"]
        told = []
        if self.after > _WORSE * self.before:
            told.append("worse")
        if self.ratio > _MISSED and "good" in (self.trust, self.verified):
            told.append("false yes")
        if self.ratio < _AS_PREDICTED and "bad" in (self.trust, self.verified):
            told.append("false no")
        return told + (["wide"] if self.wide else [])

    def told(self, *, whole: bool) -> str:
        """One line, with the reasons of the verdicts where asked for or where a no is false."""
        line = (
            f"arm {self.arm} ({self.axes} axes), {self.poses} poses, {self.noise_um:g} µm: {self.before:.3f} -> {self.after:.3f} mm, "
            f"observed over predicted {self.ratio:.2f}, {self.trust}/{self.verified}, {self.seconds:.1f} s"
            f"{' !! ' if self.faults else ''}{', '.join(self.faults)} {self.refused} {'; '.join(self.wide)}"
        )
        return "\n    ".join([line, *(self.reasons if whole or "false no" in self.faults else ())])


def verdicts(cell: list[Tried]) -> str:
    """Number of every verdict, and of every fault, of some calibrations."""
    faults = [fault for tried in cell for fault in tried.faults]
    told = ", ".join(f"{fault} {faults.count(fault)}" for fault in dict.fromkeys(faults))
    named = (("good", "good"), ("care", "care"), ("no", "bad"))
    counts = (f"{name} {sum(t.trust == status for t in cell)}" for name, status in named)
    return f"{', '.join(counts)}; {told or 'no fault'}"


def drawn_arm(number: int) -> tuple[Body, ...]:
    """Three known arms, then arms of three to seven axes with random lengths, whose axes cross or follow each other at right angles."""
    known = (PANDA_LIKE, UR_LIKE, TX90L_LIKE)
    if number < len(known):
        return known[number]
    rng = np.random.default_rng([7, number])
    axes = 3 + number % 5
    bodies = []
    for i in range(axes):
        turn = 0.0 if i == 0 else float(rng.choice([-1, 0, 1], p=[0.4, 0.2, 0.4])) * np.pi / 2
        if i == 1:
            turn = -np.pi / 2
        size = 0.35 / (1 + 0.3 * i)
        xyz = (float(rng.uniform(0, size)), float(rng.uniform(-0.1, 0.1)), float(rng.uniform(0, size)))
        com = tuple(rng.uniform(-0.05, 0.15, 3).tolist())
        mass = float(12.0 * 0.6**i * rng.uniform(0.7, 1.4))
        half = float(rng.uniform(1.2, 2.8))
        bodies.append(Body(i - 1, xyz, (turn, 0.0, 0.0), mass, com, (-half, half)))
    arm = tuple(bodies)
    # by its module: a worker has copies of what is imported by name
    yielding_robot.CARRIER.setdefault(arm, axes - 1)
    return arm


def one(task: tuple[int, int, float]) -> Tried:
    """Calibrate one robot."""
    number, count, noise_um = task
    arm = drawn_arm(number)
    rng = np.random.default_rng([number, count, round(noise_um), 5])
    robot = YieldingRobot(arm, drive_compliance(arm, rng), rng, 1e-6 * noise_um)
    begin = Tried(number, len(arm), count, noise_um)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        model = RobotModel.from_yaml(write_robot(folder, arm), estimates=False)
        poses = read_poses(robot.write(folder / "fit.csv", count), model)
        placed = model.with_stations(poses.places)
        fresh = read_poses(robot.write(folder / "fresh.csv", FRESH, noise=False), placed)
        check = read_poses(robot.write(folder / "check.csv", 40), placed)
        start = time.process_time()
        try:
            own = calibrate(model, poses)
        except FlexcalError as error:
            return replace(begin, refused=f"{error.code}: {error}")
        seconds = time.process_time() - start
        before = uncalibrated_p90(model, poses, fresh)
        errors = prediction_errors(own.model, fresh)
        verified = verify(own.robot, check).trust
        reasons = (own.trust.because, f"verify: {verified.because}")
    limits = {"rad": np.pi, "m": 0.3}
    wide = [
        f"{p.name} ± {1.96 * std:.2g}"
        for p in own.estimate.parameters
        if p.unit in limits and not p.name.startswith("station")
        if (std := own.estimate.std(p.name)) is not None and 1.96 * std > limits[p.unit]
    ]
    return replace(
        begin,
        before=1e3 * before,
        after=1e3 * errors.all.p90,
        ratio=observed_over_predicted(errors),
        trust=own.trust.status,
        verified=verified.status,
        reasons=reasons,
        wide=tuple(wide),
        seconds=seconds,
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--arms", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--poses", type=int, nargs="+", default=POSES)
    parser.add_argument("--noise-um", type=float, nargs="+", default=NOISES_UM)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--each", action="store_true", help="print the reasons of every verdict")
    given = parser.parse_args()
    arms = range(given.first, given.first + given.arms)
    tasks = [(arm, count, noise) for count in given.poses for noise in given.noise_um for arm in arms]
    cells: dict[tuple[int, float], list[Tried]] = defaultdict(list)
    for tried in in_parallel(
        one, tasks, processes=given.processes, show=lambda tried: tried.told(whole=given.each)
    ):
        cells[tried.poses, tried.noise_um].append(tried)
    print(f"P90 before -> after, mm, median of {given.arms} arms")
    for (count, noise), own in cells.items():
        done = [t for t in own if not t.refused]
        print(
            f"{count:6d} poses, {noise:6g} µm: {np.median([t.before for t in done] or [np.nan]):.3f} -> "
            f"{np.median([t.after for t in done] or [np.nan]):.3f}; {verdicts(own)}"
        )


if __name__ == "__main__":
    main()
