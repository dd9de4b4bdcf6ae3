"""A-optimality in the logarithms of springs, and their predicted standard deviations."""

from __future__ import annotations

import numpy as np

from flexcal.design.optimality import TraceOptimal
from flexcal.estimation import Parameters, Sensitivity

DAMPING_WEIGHT = 0.01
"""Weight of a damping's variance relative to a stiffness's, both relative: a tenfold standard deviation suffices."""


def spring_criterion(parameters: Parameters) -> TraceOptimal:
    """A-optimality in the logarithms of the springs: summed variance of the stiffnesses, and of the dampings with little weight."""
    weight = np.zeros(len(parameters))
    for number, name in enumerate(parameters.names):
        key = name.rpartition(".")[2]
        weight[number] = {"stiffness": 1.0, "damping": DAMPING_WEIGHT}.get(key, 0.0)
    return TraceOptimal(np.diag(weight), "A of the springs")


def spring_std(sensitivity: Sensitivity, chosen: np.ndarray | None = None) -> dict[str, float]:
    """Predicted relative standard deviation of every stiffness and damping from the chosen candidates (default: all)."""
    std = np.sqrt(np.diag(sensitivity.covariance(chosen)))
    names = sensitivity.parameters.names
    return {
        name: float(s)
        for name, s in zip(names, std, strict=True)
        if name.endswith((".stiffness", ".damping"))
    }


def largest_stiffness_std(sensitivity: Sensitivity, chosen: np.ndarray | None = None) -> tuple[str, float]:
    """Stiffness with the largest predicted relative standard deviation, and that deviation."""
    std = {n: s for n, s in spring_std(sensitivity, chosen).items() if n.endswith(".stiffness")}
    return max(std.items(), key=lambda item: item[1])
