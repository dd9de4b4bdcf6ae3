"""Blocks of the JSON documents of rechecks and of their plans (docs/file-formats.md)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from flexcal.calibration.recheck import (
    AVERAGE_RUN,
    VISIT_ALARM,
    DetectionLimit,
    DriftSum,
    JudgedVisit,
    MovedTool,
    Suspect,
    TellingPose,
)
from flexcal.jobs.recheck.change_intervals import change_intervals
from flexcal.jobs.recheck.judgement_words import judgement_sentence, suspect_in_words
from flexcal.jobs.recheck.visit_course import CourseOverVisits
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

SHIFT = 0.05e-3
"""Shift of a joint, rad (of sliding joints m), whose probability of being found is stated."""
UNSEEN = 20e-3
"""Shift, rad or m, above which a joint counts as not seen."""


def recheck_block(
    judged: JudgedVisit,
    absolute: JudgedVisit | None,
    at_reference: JudgedVisit | None,
    suspects: Sequence[Suspect],
    reference_date: str | None,
    tools: Sequence[MovedTool],
    telling: TellingPose | None,
    expected: float,
    limits: Sequence[DetectionLimit],
) -> dict[str, Any]:
    """Block `recheck`; the arguments are attributes of `Recheck`, `expected` in m."""
    errors = judged.test.errors
    size = np.linalg.norm(errors.errors.reshape(-1, 3), axis=1) / MILLIMETRE
    noise = np.sqrt(np.trace(_blocks(errors.covariance), axis1=1, axis2=2)) / MILLIMETRE
    return {
        "verdict": judged.verdict,
        "probability": judged.probability,
        "false_alarm": VISIT_ALARM,
        "compared": errors.compared,
        "reference": reference_date,
        "noise": errors.noise,
        "instrument": judged.instrument,
        "poses": len(errors.poses),
        "suspects": [_suspect_block(s, tool, errors.model) for s, tool in zip(suspects, tools, strict=True)],
        "together": judged.together,
        "scatter": None
        if judged.scatter is None
        else {"factor": judged.scatter.factor, "p": judged.scatter.chance},
        "telling_pose": None if telling is None else {"q": telling.q, "apart_mm": telling.apart / MILLIMETRE},
        "against_calibration": _judgement_block(absolute),
        "reference_against_calibration": _judgement_block(at_reference),
        "expected_mm": expected / MILLIMETRE,
        "power": power_block(limits),
        "each": [
            {"pose": int(pose), "target": str(target), "distance_mm": float(d), "expected_mm": float(e)}
            for pose, target, d, e in zip(errors.poses.pose, errors.poses.target, size, noise, strict=True)
        ],
    }


def _judgement_block(judged: JudgedVisit | None) -> dict[str, Any] | None:
    if judged is None:
        return None
    return {
        "verdict": judged.verdict,
        "probability": judged.probability,
        "sentence": judgement_sentence(judged),
    }


def drift_block(
    drifts: Sequence[DriftSum],
    dates: Sequence[str],
    alarms: Sequence[str],
    course: CourseOverVisits | None,
) -> dict[str, Any]:
    """Block `drift`: cumulative sums over the visits of these dates; `alarms` are subjects that explain them, by their `course`."""
    return {
        "average_run": AVERAGE_RUN,
        "limit": drifts[0].limit if drifts else None,
        "visits": list(dates),
        "sums": {
            item.subject: {
                "upward": item.upward,
                "downward": item.downward,
                "alarm": item.alarm,
                "since": item.since,
                "drifts": item.subject in alarms,
            }
            for item in drifts
        },
        "alarms": list(alarms),
        "courses": [] if course is None else course.document(),
    }


def power_block(limits: Sequence[DetectionLimit]) -> dict[str, Any]:
    """Block of a JSON document on the shifts of joints that a visit finds; null where a joint is not seen."""
    return {
        "shift": SHIFT,
        "joints": {
            limit.subject: {
                "unit": limit.unit,
                "std": limit.std if limit.found < UNSEEN else None,
                "power": limit.power,
                "found_95_percent": limit.found if limit.found < UNSEEN else None,
                "least_possible": limit.bound if limit.found < UNSEEN else None,
            }
            for limit in limits
        },
    }


def _suspect_block(suspect: Suspect, tool: MovedTool, model: RobotModel) -> dict[str, Any]:
    change = suspect.change
    return {
        "kind": change.kind,
        "subject": change.subject,
        "words": suspect_in_words(suspect, model),
        "changes": change_intervals(suspect),
        "remainder": suspect.remainder,
        "same_at_these_poses": suspect.same,
        "tool_mm": {
            "mean": tool.mean / MILLIMETRE,
            "mean_interval": [v / MILLIMETRE for v in tool.mean_interval],
            "p95": tool.p95 / MILLIMETRE,
            "p95_interval": [v / MILLIMETRE for v in tool.p95_interval],
            "largest": tool.largest / MILLIMETRE,
            "at": tool.farthest,
        },
    }


def _blocks(covariance: np.ndarray) -> np.ndarray:
    """Blocks (K, 3, 3) on the diagonal of a covariance (3 K, 3 K)."""
    count = len(covariance) // 3
    return covariance.reshape(count, 3, count, 3)[np.arange(count), :, np.arange(count)]
