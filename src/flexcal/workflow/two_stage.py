"""The main job, whole: excite, identify stiffness, choose poses, measure, calibrate, verify, report (P1)."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from flexcal.calibration import Calibration, Verification, calibrate, predict, verify
from flexcal.cell import VirtualCell
from flexcal.cell.config import CellConfig
from flexcal.cell.truth import draw_truth, read_truth, write_truth
from flexcal.data import MultisinePlan, PosePlan, PoseSet, Recording, write_plan, write_poses
from flexcal.design import choose_poses, random_poses
from flexcal.elasticity import StiffnessResult, identify_stiffness
from flexcal.frequency import FrequencyResponse, frequency_responses
from flexcal.model import RobotModel
from flexcal.workflow.frequency_plans import frequency_plan
from flexcal.yaml_reader import read_yaml

Progress = Callable[[str, float], None]
"""Called with the name of the stage and the share of it that is done."""

CALIBRATION_POSES = 40
RIGID_POSES = (40, 100)
VERIFICATION_POSES = 150

STAGES = ("dynamics", "frequency", "stage1", "poses", "stage2", "verification", "report")


@dataclass(frozen=True, eq=False)
class TwoStageRun:
    """Everything that one run of the procedure made; `truth` is filled in by the final comparison alone."""

    nominal: RobotModel
    plan: MultisinePlan
    responses: tuple[FrequencyResponse, ...]
    stiffness: StiffnessResult
    calibration: Calibration
    rigid: tuple[Calibration, ...]
    verification_poses: PoseSet
    elastic: Verification
    rigid_verification: tuple[Verification, ...]
    noise_free: np.ndarray
    truth: dict[str, float]
    seconds: dict[str, float]


@dataclass
class Stopwatch:
    """Wall-clock seconds of every stage."""

    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time that the block takes to a stage."""
        started = time.perf_counter()
        yield
        self.seconds[name] += time.perf_counter() - started


def run_two_stage(
    robot: Path,
    out: Path,
    *,
    seed: int = 0,
    plan: Literal["default", "paper"] = "default",
    truth: Path | None = None,
    inertias_known: bool = False,
    progress: Progress | None = None,
) -> TwoStageRun:
    """Run the two-stage calibration on the virtual cell and leave every intermediate file in `out`.

    `robot` is a robot.yaml with cell.yaml and frequency_poses.csv beside it. The hidden truth is drawn from `seed`, or taken from the file
    `truth`; it is written to `out`/truth.yaml and read back only after everything has been identified. `inertias_known` gives the
    identification the true link inertias, to see what CAD costs. Raises `FlexcalError` for files that do not fit.
    """
    tell = progress or (lambda stage, share: None)
    watch = Stopwatch()
    nominal = RobotModel.from_yaml(robot, estimates=False)
    config = read_yaml(robot.parent / "cell.yaml", CellConfig)
    out.mkdir(parents=True, exist_ok=True)
    hidden = out / "truth.yaml"
    write_truth(
        hidden,
        draw_truth(nominal, config.spread, np.random.default_rng([seed, 0]))
        if truth is None
        else read_truth(truth),
    )
    cell = VirtualCell(nominal.with_values(read_truth(hidden)), config, seed, controller_model=nominal)
    believed = nominal.with_values(_inertias(read_truth(hidden))) if inertias_known else nominal

    frequency = frequency_plan(nominal, robot.parent / "frequency_poses.csv", plan, seed)
    write_plan(out / "frequency_plan.yaml", frequency)
    with watch.stage("frequency"):
        responses = tuple(
            measure_responses(cell, frequency, believed, lambda share: tell("frequency", share))
        )
    for response in responses:
        response.save(out / f"response_pose_{response.pose + 1}.npz")
    with watch.stage("stage1"):
        tell("stage1", 0.0)
        stiffness = identify_stiffness(
            believed, responses, inertias_known=inertias_known, rng=np.random.default_rng([seed, 1])
        )
        elastic = believed.with_estimate(stiffness.estimate)
        tell("stage1", 1.0)
    with watch.stage("poses"):
        tell("poses", 0.0)
        chosen = choose_poses(
            elastic, CALIBRATION_POSES, rng=np.random.default_rng([seed, 2]), payload=frequency.payload
        )
        for_rigid = [
            choose_poses(believed, n, rng=np.random.default_rng([seed, 3, n]), payload=frequency.payload)
            for n in RIGID_POSES
        ]
        anywhere = random_poses(
            nominal, VERIFICATION_POSES, np.random.default_rng([seed, 4]), payload=frequency.payload
        )
        tell("poses", 1.0)
    with watch.stage("stage2"):
        tell("stage2", 0.0)
        measured = _measure(cell, chosen, out / "calibration_poses.csv")
        calibration = calibrate(elastic, measured, stiffness=stiffness.estimate)
        tell("stage2", 0.5)
        rigid = tuple(calibrate(believed, cell.measure(p), elastic=False) for p in for_rigid)
        tell("stage2", 1.0)
    with watch.stage("verification"):
        tell("verification", 0.0)
        seen = _measure(cell, anywhere, out / "verification_poses.csv")
        checked = verify(calibration.model, seen)
        rigid_checked = tuple(verify(c.model, seen, elastic=False) for c in rigid)
        true = read_truth(hidden)
        noise_free = cell.noise_free(anywhere)
        tell("verification", 1.0)
    return TwoStageRun(
        nominal,
        frequency,
        responses,
        stiffness,
        calibration,
        rigid,
        seen,
        checked,
        rigid_checked,
        noise_free,
        true,
        watch.seconds,
    )


def measure_responses(
    cell: VirtualCell, plan: MultisinePlan, model: RobotModel, progress: Callable[[float], None]
) -> Iterator[FrequencyResponse]:
    """Run a frequency experiment and reduce every pose to its response as the recordings come; none is kept."""
    total = len(plan.poses) * plan.recordings_per_pose

    def counted() -> Iterator[Recording]:
        for done, recording in enumerate(cell.record(plan), start=1):
            progress(done / total)
            yield recording

    names = tuple(model.joint_names[i] for i in plan.joints)
    return frequency_responses(plan, counted(), joint_names=names)


def _measure(cell: VirtualCell, plan: PosePlan, path: Path) -> PoseSet:
    poses = cell.measure(plan)
    write_poses(path, poses)
    return poses


def _inertias(truth: dict[str, float]) -> dict[str, float]:
    return {
        name: value for name, value in truth.items() if name.endswith((".mass", ".com_x", ".com_y", ".com_z"))
    }


def nominal_errors(run: TwoStageRun) -> np.ndarray:
    """Error vectors (N, 3) of the uncalibrated robot at the calibration poses, m, after rigid registration alone."""
    poses = run.calibration.poses
    from flexcal.calibration import register

    bare = predict(run.nominal, poses, elastic=False).position
    return poses.position - predict(register(run.nominal, poses, bare), poses, elastic=False).position
