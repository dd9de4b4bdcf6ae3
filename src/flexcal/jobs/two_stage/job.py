"""Complete two-stage procedure: inertials, stiffness, pose selection, measurement, calibration, verification, report (Neubauer et al.
2015).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import fit_geometry
from flexcal.calibration.measurement import predict_measurements
from flexcal.calibration.verification import (
    CALIBRATED,
    MeasuredPoints,
    arms_at,
    errors_before,
    prediction_errors,
    prediction_errors_with_covariance,
    uncalibrated_model,
)
from flexcal.data.experiments import Cell
from flexcal.data.plans import MultisinePlan, write_plan
from flexcal.data.poses import write_poses
from flexcal.data.recordings import Recording
from flexcal.design.poses import random_poses, select_poses
from flexcal.design.scene import MeasuringSetup
from flexcal.elasticity.identification import SpringFit, fit_springs
from flexcal.estimation import Estimate
from flexcal.export import export_urdf
from flexcal.files.formats import Block, provenance, write_estimates
from flexcal.frequency.periodic import FrequencyResponse, frequency_responses
from flexcal.jobs.calibration import measurement_digests
from flexcal.jobs.experiments import (
    PlanName,
    frequency_plan,
    optimise_excitation,
    plan_without_poses,
    response_sensors,
)
from flexcal.jobs.pages import report_folder, two_stage_study
from flexcal.jobs.result_files import (
    ESTIMATES,
    VERIFICATION,
    write_arm,
    write_fitted_responses,
    write_points,
    write_results,
    write_verification,
)
from flexcal.jobs.two_stage.cells import CellName, open_cell
from flexcal.jobs.two_stage.document import two_stage_document
from flexcal.jobs.two_stage.inertial_stage import run_stage_zero
from flexcal.jobs.two_stage.results import CadInertialsRun, TwoStageRun
from flexcal.model.robot import MASS_AND_COM, RobotModel
from flexcal.parallel import LocalProcesses, ThisProcess
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust
from flexcal.report.pages import two_stage_checks
from flexcal.report.results import fitted_responses
from flexcal.virtual_cell import CellConfig, read_truth

CALIBRATION_POSES, QUICK_POSES = 40, 25
RIGID_POSES = (40, 100)
RIGID_TERMS = ("kinematic", "backlash")
VERIFICATION_POSES = 150

TIMED = ("dynamics", "frequency", "stage1", "poses", "stage2", "verification", "cad_alone")
STAGES = (*TIMED, "report")


@dataclass
class Stopwatch:
    """Wall-clock seconds of every stage, the report's excepted."""

    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(TIMED, 0.0))

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the duration of the block to a stage."""
        started = time.perf_counter()
        yield
        self.seconds[name] += time.perf_counter() - started


@dataclass(frozen=True, eq=False)
class StageOne:
    """Stage 1 of a run: its fit depends on the robot that it starts from alone."""

    responses: tuple[FrequencyResponse, ...]
    plan: MultisinePlan
    seed: int
    inertias_known: bool

    def springs(self, model: RobotModel, progress: Progress = silent) -> SpringFit:
        """Springs of a robot with the inertials of `model`."""
        return fit_springs(
            model,
            self.responses,
            inertias_known=self.inertias_known,
            plan=self.plan,
            rng=np.random.default_rng([self.seed, 1]),
            progress=progress,
        )


def run_two_stage(
    robot_file: Path,
    out: Path,
    *,
    seed: int = 0,
    plan: PlanName = "default",
    cell: CellName = "virtual",
    config: CellConfig | None = None,
    truth: Path | None = None,
    inertias_known: bool = False,
    report: bool = True,
    command: str = "",
    progress: Progress = silent,
) -> TwoStageRun:
    """Run the two-stage calibration on a simulated robot and write every intermediate file, results.json and report.html in `out`.

    `robot_file` is a robot.yaml with frequency_poses.csv and, for a virtual cell without `config`, cell.yaml beside it. The hidden truth is
    drawn from `seed`, or taken from the file `truth`; it is written to `out`/truth.yaml and read back only after everything has been
    identified and stored. `inertias_known` gives the identification the true link inertias, to see what CAD costs. The plans `designed` and
    `quick` are chosen for the robot as stage 0 left it; `quick` takes half the time, and 25 calibration poses instead of 40. The robot of
    the hard `cell` has other parameters than the model: truth.yaml holds those that have a counterpart. What CAD alone would have found is
    told for the virtual cell, fitted in a process beside this one where the machine has a second core.

    Raises `FlexcalError` for files that do not fit.
    """
    # what nothing else waits for runs beside
    with closing(LocalProcesses(1) if (os.cpu_count() or 1) > 1 else ThisProcess()) as beside:
        watch = Stopwatch()
        nominal = RobotModel.from_yaml(robot_file, estimates=False)
        hidden = out / "truth.yaml"
        robot_in_cell = open_cell(
            cell, robot_file, nominal, truth=truth, hidden=hidden, seed=seed, config=config
        )
        dynamics = None
        if inertias_known:
            believed = nominal.with_values(_inertias(read_truth(hidden)))
        else:
            with watch.stage("dynamics"):
                dynamics = run_stage_zero(robot_in_cell, nominal, out, seed=seed, progress=progress)
            believed = nominal.with_estimate(dynamics)

        if plan == "default" or plan == "paper":
            frequency = frequency_plan(nominal, robot_file.parent / "frequency_poses.csv", plan, seed)
        else:
            with watch.stage("frequency"):
                flat = plan_without_poses(believed, plan, seed=seed)
                frequency = optimise_excitation(
                    believed, flat, sensors=response_sensors(robot_file)
                ).planned.plan
        write_plan(out / "frequency_plan.yaml", frequency)
        with watch.stage("frequency"):
            responses = tuple(
                measure_responses(
                    robot_in_cell, frequency, believed, lambda share: progress("frequency", share)
                )
            )
        files = [out / f"response_pose_{response.pose + 1}.npz" for response in responses]
        for response, file in zip(responses, files, strict=True):
            response.save(file)
        stage_one = StageOne(responses, frequency, seed, inertias_known)
        cad_springs = None
        if dynamics is not None and cell == "virtual":
            cad_springs = beside.values(stage_one.springs, [nominal])
        with watch.stage("stage1"):
            progress("stage1", 0.0)
            stiffness = stage_one.springs(
                believed, lambda part, share: progress("stage1", (share + (part == "fitting")) / 2)
            )
            elastic = stiffness.robot(believed)
            progress("stage1", 1.0)
        with watch.stage("poses"):
            progress("poses", 0.0)
            setup = MeasuringSetup(payload=frequency.payload)
            count = QUICK_POSES if plan == "quick" else CALIBRATION_POSES
            chosen = select_poses(elastic, count, rng=np.random.default_rng([seed, 2]), setup=setup).plan
            progress("poses", 0.25)
            for_rigid = [
                select_poses(believed, n, rng=np.random.default_rng([seed, 3, n]), setup=setup).plan
                for n in RIGID_POSES
            ]
            progress("poses", 0.9)
            anywhere = random_poses(nominal, VERIFICATION_POSES, np.random.default_rng([seed, 4]), setup)
            progress("poses", 1.0)
        with watch.stage("stage2"):
            progress("stage2", 0.0)
            measured = robot_in_cell.measure(chosen)
            calibration = fit_geometry(elastic, measured)
            progress("stage2", 0.5)
            rigid = tuple(
                fit_geometry(believed, robot_in_cell.measure(p), terms=RIGID_TERMS, elastic=False)
                for p in for_rigid
            )
            progress("stage2", 1.0)
        write_poses(out / "calibration_poses.csv", measured)
        options = {"plan": plan, "seed": seed, "inertias_known": inertias_known}
        options |= {"bearings": elastic.bearings} if elastic.has_bearings else {}
        geometry = replace(calibration.estimate, measurements=measurement_digests(measured))
        stored = _store(out, (robot_file, nominal.urdf), files, options, stiffness.estimate, geometry)
        calibration = replace(calibration, estimate=stored)
        exported = export_urdf(calibration.model, out / "calibrated.urdf")
        with watch.stage("verification"):
            progress("verification", 0.0)
            seen = robot_in_cell.measure(anywhere)
            write_poses(out / "verification_poses.csv", seen)
            known = read_truth(hidden)
            exact = replace(seen, position=robot_in_cell.noise_free(anywhere))
            floor = None
            if cell == "virtual":
                floor = ErrorStatistics.of(
                    exact.position - predict_measurements(nominal.with_values(known), exact).position
                )
            placed = uncalibrated_model(nominal, measured)
            assert placed.registered is not None and placed.own is not None
            measured_verification, measured_covariance = prediction_errors_with_covariance(
                calibration.model, seen
            )
            run = TwoStageRun(
                nominal=nominal,
                informed=believed,
                dynamics=dynamics,
                plan=frequency,
                responses=responses,
                stiffness=stiffness,
                calibration=calibration,
                rigid=rigid,
                before=placed.errors(measured),
                verification_poses=exact,
                nominal_verification=prediction_errors(
                    placed.registered, exact, elastic=False, noise_free=True
                ),
                own_verification=prediction_errors(placed.own, exact, elastic=False, noise_free=True),
                elastic_verification=prediction_errors(calibration.model, exact, noise_free=True),
                rigid_verification=tuple(
                    prediction_errors(c.model, exact, elastic=False, noise_free=True) for c in rigid
                ),
                measured_verification=measured_verification,
                measured_covariance=measured_covariance,
                floor=floor,
                truth=known,
                seconds=watch.seconds,
                seed=seed,
                cell=cell,
                command=command,
            )
            progress("verification", 1.0)
        if cad_springs is not None:
            with watch.stage("cad_alone"):
                progress("cad_alone", 0.0)
                springs = next(cad_springs)
                fitted = fit_geometry(springs.robot(nominal), measured)
                run = replace(
                    run,
                    cad_alone=CadInertialsRun(
                        springs, fitted, prediction_errors(fitted.model, exact, noise_free=True)
                    ),
                )
                progress("cad_alone", 1.0)
        run = replace(run, results=two_stage_document(run, exported))
        progress("report", 0.0)
        write_fitted_responses(out, fitted_responses(stiffness, nominal))
        write_verification(out / VERIFICATION, run)
        points = MeasuredPoints(
            measured, errors_before(run.before) | {CALIBRATED: calibration.residuals}, calibration.ambiguous
        )
        write_points(out, points)
        write_arm(out, arms_at(calibration.model, measured, points.shown))
        write_results(out, run.results)
        trust = Trust(two_stage_checks(two_stage_study(out)))
        run = replace(run, trust=trust, results={**run.results, "verdict": trust.document()})
        write_results(out, run.results)
        if report:
            report_folder(out)
        progress("report", 1.0)
        return run


def measure_responses(
    cell: Cell, plan: MultisinePlan, model: RobotModel, progress: Callable[[float], None]
) -> Iterator[FrequencyResponse]:
    """Run a frequency experiment and reduce every pose to its response as recordings arrive; none is stored."""
    total = len(plan.poses) * plan.recordings_per_pose

    def counted() -> Iterator[Recording]:
        for done, recording in enumerate(cell.record(plan), start=1):
            progress(done / total)
            yield recording

    names = tuple(model.joint_names[i] for i in plan.joints)
    return frequency_responses(plan, counted(), joint_names=names)


def _store(
    out: Path,
    robot: Sequence[Path],
    responses: Sequence[Path],
    options: Mapping[str, object],
    stiffness: Estimate,
    geometry: Estimate,
) -> Estimate:
    """Store both blocks of `out`/estimates.yaml with their provenance."""
    path = out / ESTIMATES
    used: tuple[Block, ...] = () if options["inertias_known"] else ("dynamics",)
    origin = provenance([*robot, out / "frequency_plan.yaml", *responses], options, path, used)
    write_estimates(path, "stiffness", replace(stiffness, provenance=origin))
    origin = provenance([*robot, out / "calibration_poses.csv"], options, path, (*used, "stiffness"))
    stored = replace(geometry, provenance=origin)
    write_estimates(path, "calibration", stored)
    return stored


def _inertias(truth: dict[str, float]) -> dict[str, float]:
    return {name: value for name, value in truth.items() if name.rpartition(".")[2] in MASS_AND_COM}
