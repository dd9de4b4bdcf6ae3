"""The amplitude spectrum that tells most: more power where the response depends on the springs, the same power in all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.design.planned_responses import PlannedResponses
from flexcal.design.spring_criterion import spring_criterion

LEAST, MOST = 0.5, 2.5
"""Amplitude of any line over that of the flat spectrum of the same power: below, the response's logarithm would be biased at that line;
above, friction would no longer be the disturbance that was predicted."""
ITERATIONS = 15


def shaped(planned: PlannedResponses) -> MultisinePlan:
    """The plan, whose spectrum is flat, with amplitudes of the same power that make `spring_criterion` small in its poses.

    The multiplicative algorithm for optimal designs (Silvey, Titterington & Torsney 1978): the power of a line grows with the root of
    what more of it would gain, axis by axis, within `LEAST` and `MOST`.
    """
    criterion = spring_criterion(planned.parameters)
    plan, responses = planned.plan, planned.responses
    mean = np.mean(plan.amplitude**2, axis=1, keepdims=True)
    best, lowest = plan, np.inf
    for _ in range(ITERATIONS):
        information = planned.prior_information + sum((r := x.rows(plan)).T @ r for x in responses)
        trace = criterion.trace(information)
        if trace < lowest:
            best, lowest = plan, trace
        gain = np.sum([x.gains(plan, criterion.gradient(information)) for x in responses], axis=0)
        power = plan.amplitude**2
        power = within(power * np.sqrt(gain / np.sum(gain * power, axis=1, keepdims=True)), mean)
        plan = replace(plan, amplitude=np.sqrt(power))
    return best


def within(power: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Powers (E, L), scaled and clipped so that each axis has the `mean` (E, 1) and no line leaves `LEAST` and `MOST` (of amplitude)."""
    low, high = LEAST**2 * mean, MOST**2 * mean
    small, large = np.zeros_like(mean), high / power.min(axis=1, keepdims=True)
    for _ in range(60):
        scale = (small + large) / 2
        over = np.clip(scale * power, low, high).mean(axis=1, keepdims=True) > mean
        small, large = np.where(over, small, scale), np.where(over, scale, large)
    return np.clip(scale * power, low, high)
