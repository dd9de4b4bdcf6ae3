"""A two-stage run simulated from the model itself, without the virtual cell: what the report tests render."""

from __future__ import annotations

import time
from dataclasses import replace
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
from flexcal.data.plans import MultisinePlan, write_plan
from flexcal.data.poses import PoseSet
from flexcal.elasticity.identification import SpringFit
from flexcal.estimation import Estimate, Parameter, Parameters
from flexcal.export import export_urdf
from flexcal.files.formats import Block, write_estimates
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.jobs.result_files import (
    write_arm,
    write_fitted_responses,
    write_points,
    write_results,
    write_verification,
)
from flexcal.jobs.two_stage import TwoStageRun
from flexcal.jobs.two_stage.document import two_stage_document
from flexcal.model.robot import GEOMETRY, SPRINGS, RobotModel, spring_names
from flexcal.model.vibration import linearise, transfer_matrix
from flexcal.report.results import fitted_responses
from flexcal.units import DEGREE

DEFAULT_POSES_DEG = (
    (0, -28.6, -94.3, 37.3, -98.1, 0),
    (0, 60.1, -105.0, 79.6, 67.5, 0),
    (0, 56.3, -8.0, -100.1, 41.0, 0),
)
UNSEEN = "joint_3.bearing_y.damping"
BACKLASH = {"joint_2.backlash": 3.5e-5, "joint_3.backlash": 4.1e-5}


def hidden_truth(model: RobotModel, rng: np.random.Generator) -> dict[str, float]:
    """A robot as far from its data sheet as the virtual cell's."""
    truth = {
        name: value * (1 + 0.07 * rng.normal())
        for name, value in model.values.items()
        if name.endswith(".mass")
    }
    truth = {name: value for name, value in truth.items() if name != "payload.mass"}
    for joint in model.joints:
        for key in "xyz":
            name = f"{joint.link}.com_{key}"
            truth[name] = model.value(name) + 0.01 * rng.normal()
    for owner in (*model.joint_names, "tool"):
        for key in GEOMETRY:
            truth[f"{owner}.{key}"] = (3e-4 if key.startswith("length") else 5e-4) * rng.normal()
    for elastic in model.elastic:
        for spring in SPRINGS:
            for kind in ("stiffness", "damping"):
                name = f"{elastic.name}.{spring}.{kind}"
                truth[name] = model.value(name) * np.exp(
                    (0.15 if kind == "stiffness" else 0.3) * rng.normal()
                )
    station = {f"station.tracker.{key}": 3e-4 * rng.normal() for key in "xyz"}
    return truth | BACKLASH | station


def stage_one(model: RobotModel, truth: dict[str, float], rng: np.random.Generator) -> Estimate:
    """An estimate as stage 1 would hand it over: the truth with known errors, one damping that nothing determines."""
    items, stds = [], []
    for kind, size in (("stiffness", 0.012), ("damping", 0.06)):
        for elastic in model.elastic:
            for spring in ("drive", "bearing_x", "bearing_y"):
                name = f"{elastic.name}.{spring}.{kind}"
                std = 1.3 if name == UNSEEN else size * rng.uniform(0.4, 2.0)
                value = float(truth[name] * np.exp(std * rng.normal()))
                unit = "N m/rad" if kind == "stiffness" else "N m s/rad"
                items.append(Parameter(name, unit, value, prior_std=1.5, scale="log"))
                stds.append(std)
    for i, joint in enumerate(model.joints):
        name = f"{joint.link}.mass"
        if i >= 1 and model.links.mass[i] > 0:
            items.append(
                Parameter(
                    name, "kg", float(truth[name] * np.exp(0.02 * rng.normal())), prior_std=0.07, scale="log"
                )
            )
            stds.append(0.02)
    for i, joint in enumerate(model.joints):
        for key in "xyz":
            name = f"{joint.link}.com_{key}"
            if i >= 1 and model.links.mass[i] > 0:
                items.append(Parameter(name, "m", truth[name] + 0.002 * rng.normal(), prior_std=0.01))
                stds.append(0.002)
    covariance = np.diag(np.square(stds))
    return Estimate(
        Parameters(items), covariance, len(items), (), tuple(i.name != UNSEEN for i in items), 812.0, 1584.3, 1530,
        "converged", "the step became small", 14,
    )  # fmt: skip


def response_at(model: RobotModel, q: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """G (L, 3, 3) of the linearised robot."""
    return transfer_matrix(linearise(model, q), lines).response


def measured_response(
    model: RobotModel, q: np.ndarray, pose: int, lines: np.ndarray, rng: np.random.Generator
) -> FrequencyResponse:
    """The robot's response with noise and distortion of plausible size."""
    exact = response_at(model, q, lines)
    diagonal = np.abs(np.diagonal(exact, axis1=1, axis2=2))
    size = np.sqrt(diagonal[:, :, None] * diagonal[:, None, :])
    std = 0.012 * size + 2e-4
    noise = 0.35 * std
    draws = rng.normal(size=(4, *exact.shape, 2)) @ np.array([1.0, 1j]) / np.sqrt(2.0)
    realisations = exact + 2.0 * std * draws
    vector = np.swapaxes(std, 1, 2).reshape(len(lines), -1)
    quiet = np.swapaxes(noise, 1, 2).reshape(len(lines), -1)
    return FrequencyResponse(
        lines, realisations.mean(0), vector[:, :, None] ** 2 * np.eye(9) + 0j, quiet[:, :, None] ** 2 * np.eye(9) + 0j,
        45.0, realisations, ("joint_1", "joint_2", "joint_3"), q, 6.0, pose, 2.5e-4,
    )  # fmt: skip


def random_poses(model: RobotModel, count: int, rng: np.random.Generator) -> np.ndarray:
    """Joint positions (count, n) anywhere within 80 % of the limits, the target above the floor."""
    lower = np.array([joint.lower for joint in model.joints])
    upper = np.array([joint.upper for joint in model.joints])
    q = 0.5 * (lower + upper) + 0.4 * (upper - lower) * rng.uniform(-1, 1, (6 * count, model.n))
    height = predict_measurements(model, pose_set(q, np.zeros((len(q), 3)))).position[:, 2]
    return q[height > -0.2][:count]


def pose_set(q: np.ndarray, position: np.ndarray, sigma: float = 2.2e-5) -> PoseSet:
    """Poses without extras."""
    size = len(q)
    return PoseSet(
        q, position, np.full((size, 3), sigma), None, None, np.full(size, "smr"), np.full(size, "tracker"), None, np.arange(1, size + 1)
    )  # fmt: skip


def measured(model: RobotModel, q: np.ndarray, rng: np.random.Generator | None) -> PoseSet:
    """What the instrument reads at `q`, without noise where there is no `rng`."""
    exact = pose_set(q, np.zeros((len(q), 3)))
    position = predict_measurements(model, exact).position
    return pose_set(q, position if rng is None else position + exact.sigma * rng.normal(size=position.shape))


def simulate_run(nominal: RobotModel, seed: int = 1) -> TwoStageRun:
    """Everything a demo would have found, in a few seconds."""
    rng = np.random.default_rng(seed)
    truth = hidden_truth(nominal, rng)
    robot = nominal.with_values(truth)
    lines = 0.25 * np.arange(13, 320, 2)
    poses = np.array(DEFAULT_POSES_DEG) * DEGREE
    responses = tuple(measured_response(robot, q, k, lines, rng) for k, q in enumerate(poses))
    estimate = stage_one(nominal, truth, rng)
    softer = nominal.with_estimate(estimate)
    predicted = tuple(response_at(softer, r.q_mean, lines) for r in responses)
    errors = tuple(r.response - g for r, g in zip(responses, predicted, strict=True))
    misfit = np.array(
        [np.mean((np.abs(e) / r.std) ** 2, axis=0) for e, r in zip(errors, responses, strict=True)]
    )
    sensed = tuple(g[:, :0] for g in predicted)
    stiffness = SpringFit(estimate, responses, predicted, errors, misfit, spring_names(nominal), None, sensed)
    plan = MultisinePlan(
        name="default", poses=poses, joints=(0, 1, 2), payload=6.0, base_frequency_hz=0.25, lines=np.arange(13, 320, 2),
        amplitude=np.full((3, len(lines)), 8.0), periods=4, settle_periods=2, realisations=4, signs=True,
        reference_amplitude=1.5 * DEGREE, reference_frequency_hz=2.125, kp=np.full(6, 1e3), kd=np.full(6, 1e2),
        rate_hz=4000.0, torque="held", seed=seed,
    )  # fmt: skip
    started = time.perf_counter()
    q = random_poses(nominal, 100, rng)
    calibrated = fit_geometry(softer, measured(robot, q[:40], rng))
    rigid = tuple(fit_geometry(nominal, measured(robot, q[:size], rng), elastic=False) for size in (40, 100))
    q_verify = random_poses(nominal, 150, rng)
    exact = measured(robot, q_verify, None)
    noisy = measured(robot, q_verify, rng)
    took = time.perf_counter() - started
    seen, covariance = prediction_errors_with_covariance(calibrated.model, noisy)
    floor = 2.0e-5 * rng.normal(size=exact.position.shape)
    placed = uncalibrated_model(nominal, calibrated.poses)
    assert placed.registered is not None and placed.own is not None
    return TwoStageRun(
        nominal=nominal,
        informed=nominal,
        plan=plan,
        responses=responses,
        stiffness=stiffness,
        calibration=calibrated,
        rigid=rigid,
        before=placed.errors(calibrated.poses),
        verification_poses=exact,
        nominal_verification=prediction_errors(placed.registered, exact, elastic=False, noise_free=True),
        own_verification=prediction_errors(placed.own, exact, elastic=False, noise_free=True),
        elastic_verification=prediction_errors(calibrated.model, exact, noise_free=True),
        rigid_verification=tuple(
            prediction_errors(fit.model, exact, elastic=False, noise_free=True) for fit in rigid
        ),
        measured_verification=seen,
        measured_covariance=covariance,
        floor=ErrorStatistics.of(floor),
        truth=truth,
        seconds={
            "frequency": 61.2,
            "stage1": 4.1,
            "poses": 12.6,
            "stage2": took,
            "verification": 0.8,
        },
        seed=seed,
        command=f"flexcal demo --seed {seed} --out demo",
    )


def leave_run(folder: Path, run: TwoStageRun) -> None:
    """The files of a demo's folder that its report is made of."""
    fit = run.calibration
    blocks: dict[Block, Estimate] = {"stiffness": run.stiffness.estimate, "calibration": fit.estimate}
    for block, estimate in blocks.items():
        origin = {"program": "flexcal 1", "input.of_both": 64 * "b", f"input.of_{block}": 64 * block[0]}
        write_estimates(folder / "estimates.yaml", block, replace(estimate, provenance=origin))
    write_plan(folder / "frequency_plan.yaml", run.plan)
    write_fitted_responses(folder, fitted_responses(run.stiffness, run.nominal))
    write_verification(folder / "verification.csv", run)
    points = MeasuredPoints(fit.poses, errors_before(run.before) | {CALIBRATED: fit.residuals}, fit.ambiguous)
    write_points(folder, points)
    write_arm(folder, arms_at(fit.model, fit.poses, points.shown))
    exported = export_urdf(fit.model, folder / "calibrated.urdf")
    write_results(folder, two_stage_document(run, exported))
