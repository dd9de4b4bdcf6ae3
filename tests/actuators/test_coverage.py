"""Intervals of actuators hold the truth as often as they say, over arms with other actuators, commands and noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from over_seeds import over_seeds
from servo_arm import NAMES, TRUTH, Servo, arm, command, simulate

from flexcal.actuators import Servo as Known
from flexcal.actuators import fit_actuators
from flexcal.data.recordings import CommandLog
from flexcal.model.robot import RobotModel

ARMS, RATE, SECONDS, NOISE = 20, 100.0, 40.0, 2e-4


def judged(
    k: int, model: RobotModel, truth: Servo, commands: np.ndarray, positions: np.ndarray
) -> tuple[list[bool], list[float]]:
    """Of the parameters of one arm: whether the interval holds the truth, and the error over its standard deviation."""
    noise = NOISE * np.random.default_rng(100 + k).standard_normal(positions[k].shape)
    fit = fit_actuators(model, [CommandLog(1 / RATE, commands[k], positions[k] + noise)], Known())
    hits, scores = [], []
    for name in fit.estimate.parameters.names:
        joint, _, key = name.split(".")
        true = getattr(truth, key)[k, NAMES.index(joint)]
        true += truth.viscous[k, NAMES.index(joint)] if key == "damping" else 0.0
        low, high = fit.estimate.interval(name) or (np.inf, -np.inf)
        hits.append(low <= true <= high)
        scores.append((fit.estimate.values[name] - true) / (fit.estimate.std(name) or np.nan))
    return hits, scores


@pytest.mark.slow
def test_intervals_cover(tmp_path: Path) -> None:
    """95 % intervals of ten parameters of twenty arms, which scatter by 30 %."""
    model, rng = arm(tmp_path), np.random.default_rng(1)
    spread = [value * np.exp(0.3 * rng.standard_normal((ARMS, 2))) for value in TRUTH.values().values()]
    truth = Servo(*spread)
    commands = np.stack([command(SECONDS, RATE, np.random.default_rng(seed)) for seed in range(ARMS)])
    positions = simulate(truth, commands, RATE)
    hits, scores = np.hstack(over_seeds(judged, range(ARMS), model, truth, commands, positions))
    assert 0.90 <= np.mean(hits) <= 0.98
    assert 0.8 < np.std(scores) < 1.2
