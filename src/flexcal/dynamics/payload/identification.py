"""Identification of mass, centre of mass and inertia of a payload from torques, with the robot's own dynamics as prior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.payload.equations import PayloadEquations
from flexcal.dynamics.payload.rigid_body import (
    body_covariance,
    identified_moments,
    link_frame_from_payload,
    nearest_body,
    payload_from_link_frame,
)
from flexcal.dynamics.payload.torque_noise import first_noise, residual_noise
from flexcal.dynamics.regression import RegressionData, score_covariance
from flexcal.errors import FlexcalError
from flexcal.estimation import Dropped, Estimate, Parameter, Parameters, analyse, student_quantile
from flexcal.model.parts import LINK_PARAMETERS, Payload
from flexcal.model.robot import MASS_AND_COM, MOMENTS, unit_of

BODY = (*MASS_AND_COM, *MOMENTS)
"""Names of a payload's parameters in its frame: inertia about the centre of mass."""
_UNSEEN = 5e-3
"""Mass relative to that of all links, below which model errors imitate a mass."""
_ROUNDS = 4
"""Number of fits, each weighted by the noise of the previous residual."""


@dataclass(frozen=True, eq=False)
class PayloadFit:
    """The `estimate` of `payload.mass` and so on.

    `rise` is by how much a body with these raises the sum of squares above its minimum; `error` the share of the torques' norm that is
    missed, `joint_errors` (n,) that of every joint by itself, and `own_error` that which the base parameters miss that fit each joint and
    recording best (NaN where too short). These errors are those of all `unknowns` (u,) of the equations, before the nearest body.
    """

    estimate: Estimate
    rise: float
    error: float
    joint_errors: np.ndarray
    own_error: float
    unknowns: np.ndarray


@dataclass(frozen=True, eq=False)
class _Solution:
    """Solution for the payload's ten parameters: `values` and their `covariance`, with its degrees of `freedom`.

    All `unknowns` (u,) have `unknowns_root` (u, k) as the root of their plain covariance, which `root` (10, k) is a part of. `missing` says
    what the data do not tell, and `unseen` (10, d) along which directions.
    """

    values: np.ndarray
    covariance: np.ndarray
    unknowns: np.ndarray
    unknowns_root: np.ndarray
    freedom: float
    missing: tuple[Dropped, ...]
    unseen: np.ndarray
    root: np.ndarray
    cost: float
    chi2: float
    freedom_left: int


def fit_payload(equations: PayloadEquations) -> PayloadFit:
    """Bayesian weighted least squares, without prior of the payload; then the nearest consistent payload (Wensing et al. 2018).

    The intervals include the uncertainty of the robot, and errors correlated in time and between joints (`score_covariance`).
    What the motion does not tell of the payload stays as declared, and so does inertia whose intervals tell no body from a point
    (`identified_moments`). Raises `FlexcalError` as `residual_noise` does, and where the 95 % interval of the mass contains zero
    or lies below it.
    """
    payload, noise = equations.attached, first_noise(equations)
    solution = _solve(equations, noise, np.zeros(len(LINK_PARAMETERS)))
    for _ in range(_ROUNDS):
        start = np.zeros(len(LINK_PARAMETERS))
        if solution.missing and solution.values[0] > 0:
            start = _declared(payload, float(solution.values[0]))
        noise = residual_noise(equations, noise, solution.unknowns, solution.unknowns_root)
        solution = _solve(equations, noise, start)
    quantile = student_quantile(0.975, solution.freedom)
    least = float(solution.values[0]) - quantile * float(np.sqrt(solution.covariance[0, 0]))
    if "payload.mass" in {entry.name for entry in solution.missing}:
        raise FlexcalError(
            "E-DYN-020",
            "the payload's mass is not identifiable beside the robot's own inertia in this motion; move the joints that lift "
            "it, or give --free logs.",
        )
    most, robot = (
        2 * float(solution.values[0]) - least,
        float(equations.data.observation.model.links.mass.sum()),
    )
    if most < -_UNSEEN * robot:
        raise FlexcalError(
            "E-DYN-021",
            f"the estimated mass of the payload is negative ({solution.values[0]:.3g} kg, 95 % interval {least:.3g} to {most:.3g} kg), "
            "as of no body: the robot's own dynamics were identified with a payload, are of another robot, or the torques have another "
            "sign or scale in these logs.",
        )
    if not least > 0:
        raise FlexcalError(
            "E-DYN-022",
            f"no payload can be told from zero: its estimated mass is {solution.values[0]:.3g} kg, with an upper 95 % limit of "
            f"{most:.3g} kg; check that it was held, the signs of the torques and the robot's own dynamics.",
        )
    nearest = nearest_body(solution.values, solution.root, solution.unseen)
    body = payload_from_link_frame(nearest.parameters)
    covariance = body_covariance(nearest.parameters, solution.covariance)
    half = quantile * np.sqrt(np.diag(covariance))
    missing = {entry.name for entry in solution.missing}
    told = np.array([f"payload.{key}" not in missing for key in LINK_PARAMETERS])
    told[4:] = identified_moments(body, half[4:]) if told[4:].all() else False
    body = np.where(told, body, _body(payload, float(body[0])))
    covariance = np.where(np.outer(told, told), covariance, 0.0)
    covariance[0] /= body[0]
    covariance[:, 0] /= body[0]
    estimate = _estimate(solution, nearest.rise, body, covariance, told)
    error, joint_errors = _missed_shares(equations, solution.unknowns)
    return PayloadFit(
        estimate, nearest.rise, error, joint_errors, _own_error(equations.data), solution.unknowns
    )


def _own_error(data: RegressionData) -> float:
    parts = zip(data.subsystems, data.noise(), strict=True)
    left = sum(sigma**2 * (s.triangle.rows - rank) for s, (sigma, rank) in parts)
    return float(np.sqrt(left / sum(np.sum(s.triangle.right**2) for s in data.subsystems)))


def _body(payload: Payload, mass: float) -> np.ndarray:
    """Declared body (10,), scaled to a mass."""
    share = mass / payload.mass if payload.mass > 0 else 0.0
    return np.concatenate([[mass], payload.com, share * payload.moments])


def _declared(payload: Payload, mass: float) -> np.ndarray:
    return link_frame_from_payload(_body(payload, mass))


def _solve(equations: PayloadEquations, noise: Sequence[float], start: np.ndarray) -> _Solution:
    """Least squares; undetermined directions of the payload stay at `start` (10,)."""
    names, own = equations.names, equations.payload
    prior = equations.prior_rows()
    data = equations.system(noise)
    system = np.vstack([data[:, :-1], prior])
    right = np.concatenate([data[:, -1], np.zeros(len(prior))]) - system[:, own] @ start
    seen = analyse(system, names, scale=_scale(system, own), prefer=names)
    kept = list(seen.kept)
    factor = np.asarray(np.linalg.qr(np.column_stack([system[:, kept], right]), mode="r"))
    scale = 1.0 / np.linalg.norm(factor[:, :-1], axis=0)
    triangle = factor[:-1, :-1] * scale
    values = np.zeros(len(names))
    values[own] = start
    values[kept] += scale * np.linalg.solve(triangle, factor[:-1, -1])
    root = scale[:, None] * np.linalg.inv(triangle)
    missed = np.append(-values, 1.0)
    chi2 = float(np.sum((data @ missed) ** 2))
    freedom = sum(s.triangle.rows for s in equations.data.subsystems) - len(kept)
    chosen = np.zeros((len(names) + 1, len(kept)))
    chosen[kept] = root
    joints = equations.data.observation.model.n
    batch_scatter = score_covariance(
        equations.batches,
        noise,
        [chosen] * joints,
        [missed] * joints,
        root,
        chi2 / max(1, freedom),
    )
    known = prior[:, kept] @ root
    covariance = np.zeros((len(names), len(names)))
    covariance[np.ix_(kept, kept)] = batch_scatter.covariance + root @ known.T @ known @ root.T
    missing = tuple(entry for entry in seen.dropped if entry.name in names[own])
    unseen = np.zeros((len(LINK_PARAMETERS), len(missing)))
    first = own.start
    for column, entry in zip(unseen.T, missing, strict=True):
        column[names.index(entry.name) - first] = 1.0
        for heir, share in entry.absorbed_by:
            if heir in names[own]:
                column[names.index(heir) - first] = -share
    return _Solution(
        values[own],
        covariance[own, own],
        values,
        chosen[:-1],
        batch_scatter.freedom,
        missing,
        unseen,
        chosen[:-1][own],
        chi2 + float(np.sum((prior @ values) ** 2)),
        chi2,
        freedom,
    )


def _missed_shares(equations: PayloadEquations, unknowns: np.ndarray) -> tuple[float, np.ndarray]:
    """Relative residual ‖errors‖ / ‖torques‖ of all equations, and of those of every joint (n,); 0 without torques."""
    missed = np.append(-unknowns, 1.0)
    left, size = np.zeros((2, equations.data.observation.model.n))
    for batch in (batch for own in equations.batches for batch in own):
        left += [np.sum((factor @ missed) ** 2) for factor in batch.factors]
    for s in equations.data.subsystems:
        size[s.equation] += np.sum(s.triangle.right**2)
    shares = np.sqrt(np.divide(left, size, out=np.zeros_like(left), where=size > 0))
    return float(np.sqrt(left.sum() / size.sum())) if size.any() else 0.0, shares


def _scale(system: np.ndarray, own: slice) -> np.ndarray:
    """Inverse size of each column; for the payload relative to the largest of its kind, since some are only rounding."""
    sizes = np.linalg.norm(system, axis=0)
    for kind in (slice(0, 1), slice(1, 4), slice(4, 10)):
        part = slice(own.start + kind.start, own.start + kind.stop)
        sizes[part] = sizes[part].max()
    return 1.0 / np.where(sizes > 0, sizes, 1.0)


def _estimate(
    solution: _Solution,
    rise: float,
    body: np.ndarray,
    covariance: np.ndarray,
    told: np.ndarray,
) -> Estimate:
    names = [f"payload.{key}" for key in BODY]
    parameters = [
        Parameter(name, unit_of(name), float(value), scale="log" if name == "payload.mass" else "linear")
        for name, value in zip(names, body, strict=True)
    ]
    message = "Bayesian weighted least squares"
    if rise > 0:
        message += f", nearest physically consistent payload; the weighted sum of squares is {rise:.3g} above its minimum"
    return Estimate(
        parameters=Parameters(parameters),
        covariance=covariance,
        rank=int(told.sum()),
        dropped=tuple(Dropped(name) for name, seen in zip(names, told, strict=True) if not seen),
        identifiable=tuple(bool(seen) for seen in told),
        cost=solution.cost + rise,
        chi2=solution.chi2 + rise,
        degrees_of_freedom=solution.freedom_left,
        status="converged",
        message=message,
        iterations=1,
        covariance_freedom=solution.freedom,
    )
