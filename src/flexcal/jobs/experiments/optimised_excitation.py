"""Frequency experiments with optimised poses and amplitudes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.design.frequency import (
    COMMON_SENSORS,
    FrequencyPoseSelection,
    PlannedResponses,
    ResponseSensors,
    Schedule,
    choose_frequency_poses,
    flat_multisine,
    optimal_amplitudes,
    within_preload,
)
from flexcal.design.scene import CollisionChecker
from flexcal.files.formats import read_yaml
from flexcal.frequency.periodic import leave_out_detection_lines
from flexcal.jobs.experiments.standard_plans import REFERENCE
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.virtual_cell import CellConfig, encoder_resolution

PlanName = Literal["default", "paper", "designed", "quick"]
"""Names of the plans; poses and amplitudes of the last two are optimised for the robot."""

POSES = 6
CANDIDATES = 300
SCHEDULES = {"designed": Schedule(0.2, 3, 1, 4), "quick": Schedule(0.3125, 3, 1, 3)}
"""Schedules of 360 and 173 s per pose with three axes."""


@dataclass(frozen=True, eq=False)
class OptimisedExcitation:
    """Optimised experiments, the same with equal amplitudes, and the pose selection of both."""

    planned: PlannedResponses
    flat: PlannedResponses
    choice: FrequencyPoseSelection


def optimise_excitation(
    model: RobotModel,
    plan: MultisinePlan,
    *,
    count: int = POSES,
    candidates: int = CANDIDATES,
    sensors: ResponseSensors = COMMON_SENSORS,
    progress: Progress = silent,
) -> OptimisedExcitation:
    """Choose `count` poses for the flat `plan`, whose own are ignored, and the amplitudes in them, for the present robot model.

    Raises `FlexcalError` as `choose_frequency_poses` does.
    """
    rng = np.random.default_rng([plan.seed, 6])
    choice = choose_frequency_poses(
        model, plan, count, candidates, rng, sensors, CollisionChecker(model), progress
    )
    progress("amplitudes", 0.0)
    flat = PlannedResponses.of(model, within_preload(model, replace(plan, poses=choice.poses)), sensors)
    progress("amplitudes", 0.3)
    planned = PlannedResponses.of(model, optimal_amplitudes(model, flat), sensors)
    progress("amplitudes", 1.0)
    return OptimisedExcitation(planned, flat, choice)


def plan_without_poses(
    model: RobotModel, kind: str, *, detection_lines: bool = False, seed: int
) -> MultisinePlan:
    """Flat plan `designed` or `quick` without valid poses; payload as declared and reference motion as in the plan `default`."""
    plan = flat_multisine(
        model,
        np.zeros((1, model.n)),
        name=kind,
        payload=None,
        reference=REFERENCE["default"],
        seed=seed,
        schedule=SCHEDULES[kind],
    )
    return leave_out_detection_lines(plan) if detection_lines else plan


def declared_sensors(robot_file: Path) -> Path | None:
    """Path of cell.yaml beside robot.yaml, if it exists."""
    file = robot_file.parent / "cell.yaml"
    return file if file.is_file() else None


def response_sensors(robot_file: Path) -> ResponseSensors:
    """Sensors that cell.yaml beside robot.yaml declares; typical ones without it."""
    file = declared_sensors(robot_file)
    if file is None:
        return COMMON_SENSORS
    sensors = read_yaml(file, CellConfig).sensors
    readings = (sensors.displacement_noise, sensors.velocity_noise, sensors.acceleration_noise)
    return ResponseSensors(encoder_resolution(sensors), sensors.torque_noise, readings)
