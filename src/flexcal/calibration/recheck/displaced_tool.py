"""How far a change moves the tool over the joint ranges of the calibration, and where two suspected changes differ most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.measurement import PredictedMeasurements, random_poses, seen_from_base
from flexcal.calibration.recheck.change_effects import (
    OF_THE_MEASUREMENT,
    WHOLE_TOOL,
    PossibleChange,
    possible_changes,
    worn_gears,
)
from flexcal.calibration.recheck.judged_visit import Suspect
from flexcal.model.kinematics import joint_limits
from flexcal.model.robot import RobotModel

_POSES = 300
_DRAWS = 400
_TURN = 2 * np.pi
"""Largest joint position, rad or m, of joints without a limit."""


@dataclass(frozen=True, eq=False)
class MovedTool:
    """Displacement of a point on the tool over random poses within the calibrated joint ranges, m.

    `mean` and `p95` over the poses with their 95 % intervals from the uncertainty of the change; `farthest` are the joint positions (n,)
    at which the tool moved most, rad or m, and `largest` how far it did there.
    """

    mean: float
    mean_interval: tuple[float, float]
    p95: float
    p95_interval: tuple[float, float]
    farthest: np.ndarray
    largest: float


@dataclass(frozen=True, eq=False)
class TellingPose:
    """Joint positions `q` (n,), rad or m, at which two changes predict points that are `apart` m."""

    q: np.ndarray
    apart: float


def moved_tool(
    model: RobotModel, ranges: Mapping[str, tuple[float, float]], suspect: Suspect, targets: Sequence[str]
) -> MovedTool:
    """Displacement of the first of the measured `targets` by a suspected change, or of those that it concerns; none by an instrument that
    moved, or a wrong reading.
    """
    at = _random_points(model, ranges, _concerned(suspect, targets))
    change = _change_at(at, suspect)
    if change is None:
        nothing = (0.0, 0.0)
        return MovedTool(0.0, nothing, 0.0, nothing, at.poses.q[0], 0.0)
    distance = _distances(change.columns @ suspect.estimate)
    # two points on a tool do not show its rotation about the line through them: the covariance may be singular
    values, vectors = np.linalg.eigh(suspect.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    rng, uncertain = np.random.default_rng(2), change.spread_at(suspect.estimate)
    drawn = suspect.estimate + rng.standard_normal((_DRAWS, len(values))) @ root.T
    effects = drawn @ change.columns.T + rng.standard_normal((_DRAWS, uncertain.shape[1])) @ uncertain.T
    spread = np.stack([_distances(effect) for effect in effects])
    mean, p95 = spread.mean(axis=1), np.quantile(spread, 0.95, axis=1)
    farthest = int(distance.argmax())
    return MovedTool(
        float(distance.mean()),
        _interval(mean),
        float(np.quantile(distance, 0.95)),
        _interval(p95),
        at.poses.q[farthest],
        float(distance[farthest]),
    )


def telling_pose(
    model: RobotModel,
    ranges: Mapping[str, tuple[float, float]],
    suspects: tuple[Suspect, Suspect],
    targets: Sequence[str],
) -> TellingPose | None:
    """The pose at which two suspects differ most; None where one of them is of the instrument or a reading."""
    at = _random_points(model, ranges, targets)
    one, other = (_change_at(at, suspect) for suspect in suspects)
    if one is None or other is None:
        return None
    apart = _distances(one.columns @ suspects[0].estimate - other.columns @ suspects[1].estimate)
    best = int(apart.argmax())
    return TellingPose(at.poses.q[best], float(apart[best]))


def _random_points(
    model: RobotModel, ranges: Mapping[str, tuple[float, float]], targets: Sequence[str]
) -> PredictedMeasurements:
    limits = np.clip(joint_limits(model), -_TURN, _TURN)
    for k, name in enumerate(model.motor_names):
        if name in ranges:
            low, high = ranges[name]
            limits[:, k] = max(limits[0, k], low), min(limits[1, k], high)
    return seen_from_base(model, random_poses(model, limits, targets, _POSES), jacobians=True)


def _change_at(at: PredictedMeasurements, suspect: Suspect) -> PossibleChange | None:
    """The suspected change with its effect on other points; None for those of the measurement."""
    if suspect.change.kind in OF_THE_MEASUREMENT:
        return None
    there = {
        (change.kind, change.subject): change
        for change in (*possible_changes(at.model, at), *worn_gears(at.model, at))
    }
    if suspect.change.parts:
        one, other = (there[part.kind, part.subject] for part in suspect.change.parts)
        return PossibleChange.of_two(one, other)
    return there[suspect.change.kind, suspect.change.subject]


def _concerned(suspect: Suspect, targets: Sequence[str]) -> Sequence[str]:
    """Points that a change is shown at: its own, all of a tool that moved, else the first."""
    subject = suspect.change.subject
    if subject == WHOLE_TOOL:
        return targets
    return [subject] if subject in targets else targets[:1]


def _distances(displacement: np.ndarray) -> np.ndarray:
    return np.linalg.norm(displacement.reshape(-1, 3), axis=1)


def _interval(values: np.ndarray) -> tuple[float, float]:
    low, high = np.quantile(values, [0.025, 0.975])
    return float(low), float(high)
