"""Feasible start of the design of an exciting trajectory: a posture and a small motion about it within all limits."""

from __future__ import annotations

import numpy as np

from flexcal.design.trajectories.excitation_problem import ExcitationProblem
from flexcal.errors import FlexcalError, InputError
from flexcal.model.kinematics import low_discrepancy_configurations

FINER = 10
"""Ratio of the grid on which limits must hold to that of the search."""
_PLACES = 400
_TRIES = 30
_HALVINGS = 14
_FIRST_SWING = 0.5


def feasible_postures(program: ExcitationProblem) -> np.ndarray:
    """Configurations (k, n) of rest within all limits of torque and box and without collision.

    Raises `FlexcalError` that names what stands in the way least where there is none.
    """
    model = program.columns.model
    places = low_discrepancy_configurations(model, _PLACES)
    excess = program.standing(places)
    worst = excess.max(axis=1)
    if (worst < 0).any():
        return places[worst < 0]
    best = int(np.argmin(worst))
    raise FlexcalError(
        "E-DESIGN-043",
        f"{model.name} has no feasible posture within its limits: at best, at q = {_written(places[best])}, "
        f"{program.standing_limit(places[best])}; correct that limit.",
    )


def require_holding_torque(program: ExcitationProblem, q: np.ndarray) -> None:
    """Raise `InputError` that names the limit exceeded by a robot at rest in `q` (n,)."""
    if not program.standing(q[None]).max() < 0:
        raise InputError(
            "E-DESIGN-044",
            f"the start q = {_written(q)} is not possible: {program.standing_limit(q)}; choose another one.",
        )


def feasible_start_motion(
    program: ExcitationProblem, places: np.ndarray | None, rng: np.random.Generator
) -> np.ndarray:
    """Coordinates of a random motion within all limits, about one of the `places` where the space leaves that open.

    Raises `FlexcalError` where even small motions pass a limit.
    """
    shape = program.space.shape
    fine = program.finer(FINER)
    for _ in range(_TRIES):
        swing = _FIRST_SWING * rng.standard_normal(shape)
        still = np.zeros(shape)
        if places is not None:
            still[0] = program.space.place(places[rng.integers(len(places))])
            swing[0] = 0.0
        for _ in range(_HALVINGS):
            x = (still + swing).ravel()
            if program.within(x) and fine.kept_by(x):
                return x
            swing /= 2
    raise FlexcalError(
        "E-DESIGN-045",
        f"no motion of {program.columns.model.name} was found within its limits, however small; widen its limits of torque, box or bodies.",
    )


def _written(q: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.3g}" for value in q) + "]"
