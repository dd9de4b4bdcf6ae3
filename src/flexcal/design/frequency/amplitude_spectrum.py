"""Optimal amplitude spectrum of a frequency experiment within effort and gravity preload."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.design.frequency.backlash_limit import amplitude_share, backlash_load, within_preload
from flexcal.design.frequency.predicted_uncertainty import PlannedResponses
from flexcal.design.frequency.spring_precision import spring_criterion
from flexcal.model.robot import RobotModel

LEAST, MOST = 0.4, 4.0
"""Bounds of the amplitude of any line relative to the flat spectrum, before all are lowered for the gaps: below, the response's
logarithm would be biased at that line; above, friction would exceed the predicted disturbance.
"""
ROOM = 2.0
"""Largest root mean square of an axis' torque relative to the flat plan: 8 % of its effort, with peaks of a quarter."""
ITERATIONS = 20


def optimal_amplitudes(model: RobotModel, planned: PlannedResponses) -> MultisinePlan:
    """Plan with amplitudes that minimise `spring_criterion` in its poses, from a plan with a flat spectrum.

    No axis gets more than `ROOM` times its torque, and no gap is strained beyond what `backlash_load` allows. The multiplicative algorithm
    for optimal designs (Silvey, Titterington & Torsney 1978): the power of a line grows with the root of what more of it would gain over
    what it costs, its share of the axis' power plus its share in the gap that is strained most. Raises `FlexcalError` as `within_preload`
    does.
    """
    criterion, plan = spring_criterion(planned.parameters), within_preload(model, planned.plan)
    allowed = ROOM**2 * np.sum(plan.amplitude**2, axis=1, keepdims=True)
    flat = plan.amplitude**2
    load = np.array([backlash_load(model, q, plan) for q in plan.poses]).reshape(-1, *flat.shape)
    best, lowest = plan, np.inf
    for _ in range(ITERATIONS):
        power = plan.amplitude**2
        information = planned.prior_information + sum((r := x.rows(plan)).T @ r for x in planned.responses)
        trace = criterion.trace(information)
        if trace < lowest:
            best, lowest = plan, trace
        gain = np.sum([x.gains(plan, criterion.gradient(information)) for x in planned.responses], axis=0)
        cost = 1 / (len(power) * allowed)
        if len(load):
            cost = cost + load[np.argmax(np.sum(load * power, axis=(1, 2)))]
        grown = power * np.sqrt(gain / cost)
        grown *= power.sum() / grown.sum()
        plan = replace(
            plan, amplitude=_feasible(np.clip(grown, LEAST**2 * flat, MOST**2 * flat), allowed, load)
        )
    return best


def _feasible(power: np.ndarray, allowed: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Amplitudes (E, L) with the power reduced to `allowed` (E, 1) axis by axis, then on all alike until every gap stays closed."""
    amplitude = np.sqrt(power * np.minimum(1.0, allowed / power.sum(axis=1, keepdims=True)))
    return min(1.0, amplitude_share(load, amplitude)) * amplitude
