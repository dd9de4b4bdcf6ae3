"""Pooling of the geometry of calibrated robots of a model into the prior of the next."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from flexcal.calibration.fit import OF_THE_CELL, FleetPrior, base_errors, plausible_size
from flexcal.errors import FlexcalError
from flexcal.estimation import Measured, deviations, population
from flexcal.jobs.fleet_prior.geometry_information import geometry_information, is_geometric_error
from flexcal.jobs.fleet_prior.member import FEWEST, Member
from flexcal.model.robot import RobotModel, unit_in

_ALIKE = 3.0
"""Largest reduced chi-square of the difference between two measurements of one robot, whose errors are not known exactly."""
_FAR_APART = 10.0
"""Factor by which those of other pairs are larger, in the median, where two measurements are of one robot."""
_FEWEST_COMBINATIONS = 5
_SAME = 1e-6
"""Relative singular value of combinations below which both calibrations tell nothing of one."""
_TOLD = 0.9
"""Variance of a mean, relative to the plausible one, below which the robots tell something of it."""


def pooled_prior(members: Sequence[Member], left_out: Sequence[str] = ()) -> FleetPrior:
    """Prior for a further robot of the model of some calibrated ones with equal terms (`estimation.population`); `left_out` says why others
    are none.

    Raises `FlexcalError` for fewer than three robots, robots of other kinematics, and those that were calibrated with
    such a prior themselves, which would count the others twice.
    """
    _require_alike(members, left_out)
    names, sizes, measured = _measured(members)
    if not names or not any(len(own.observed) for own in measured):
        raise FlexcalError(
            "E-PRIOR-012",
            f"the calibrations of {', '.join(member.name for member in members)} tell nothing of the robots that does not depend on where "
            "they stand and what they carry; calibrate them by measured points.",
        )
    pooled = population(measured, sizes, [_kind(members[0].model, name) for name in names])
    prior = FleetPrior(
        tuple(names),
        pooled.mean,
        pooled.uncertainty,
        pooled.spread,
        pooled.freedom,
        members[0].terms,
        tuple(member.name for member in members),
        {member.name: member.estimate.measurements for member in members},
    )
    told = np.diag(pooled.uncertainty) < _TOLD * sizes**2
    return prior.among(name for name, known in zip(names, told, strict=True) if known)


def of_equal_terms(members: Sequence[Member]) -> tuple[list[Member], list[str]]:
    """Robots with the terms that most were calibrated with, and remarks on the others, whose parameters mean different things.

    Raises `FlexcalError` where there are as many robots as a prior needs, but none with equal terms.
    """
    counts = Counter(member.terms for member in members)
    if not counts:
        return [], []
    terms, most = counts.most_common(1)[0]
    named = {other: ", ".join(m.name for m in members if m.terms == other) for other in counts}
    if most < FEWEST <= len(members):
        listed = "; ".join(f"{names} with {' '.join(other)}" for other, names in named.items())
        raise FlexcalError(
            "E-PRIOR-004",
            f"no {FEWEST} robots were calibrated with the same terms, so their parameters mean different things: {listed}; calibrate "
            f"all with --terms {' '.join(terms)}.",
        )
    remarks = [
        f"without {names}, calibrated with the terms {' '.join(other)} in place of {' '.join(terms)}, so that parameters mean different "
        f"things; 'flexcal calibrate --terms {' '.join(terms)}' on the same poses includes {'it' if counts[other] == 1 else 'them'}"
        for other, names in named.items()
        if other != terms
    ]
    return [member for member in members if member.terms == terms], remarks


def alike(members: Sequence[Member]) -> list[tuple[str, str, float]]:
    """Pairs of robots that are as alike as two measurements of one: their names, and how many times as far apart other pairs are.

    By the chi-square of what both calibrations tell against one set of parameters for both; the number of times is the median over pairs of
    the reduced chi-square over that of the pair, its square root.
    """
    _, sizes, measured = _measured(members)
    found = {}
    if not len(sizes):
        return []
    for (i, one), (k, other) in combinations(enumerate(measured), 2):
        rows = np.concatenate([one.rows, other.rows]) * sizes
        observed = np.concatenate([one.observed, other.observed])
        basis, values, _ = np.linalg.svd(rows, full_matrices=False)
        basis = basis[:, values > _SAME * values.max(initial=0.0)]
        left = observed - basis @ (basis.T @ observed)
        freedom = len(left) - basis.shape[1]
        if freedom >= _FEWEST_COMBINATIONS:
            found[i, k] = float(left @ left) / freedom
    middle = float(np.median(list(found.values()))) if found else 0.0
    return [
        (members[i].name, members[k].name, float(np.sqrt(middle / chi2)))
        for (i, k), chi2 in found.items()
        if chi2 < _ALIKE and middle > _FAR_APART * max(chi2, 1.0)
    ]


def geometry_deviations(members: Sequence[Member]) -> tuple[list[str], np.ndarray]:
    """Geometric errors of the robots, p names, and their deviations (N, p) from the mean over robots, as `estimation.deviations`."""
    names, sizes, measured = _measured(members)
    return names, deviations(measured, sizes)


def _measured(members: Sequence[Member]) -> tuple[list[str], np.ndarray, list[Measured]]:
    """Parameters of the robots themselves, their plausible sizes, and what each calibration tells of them."""
    model = members[0].model
    base = base_errors(model)
    named = [item.name for member in members for item in member.estimate.parameters]
    names = [name for name in dict.fromkeys(named) if is_geometric_error(model, name) and name not in base]
    sizes = np.array([plausible_size(model, name) for name in names])
    cell = [*base, *(name for name in dict.fromkeys(named) if name.startswith(OF_THE_CELL))]
    return names, sizes, [geometry_information(member.estimate, names, cell, sizes) for member in members]


def _require_alike(members: Sequence[Member], left_out: Sequence[str]) -> None:
    if len(members) < FEWEST:
        listed = ", ".join(member.name for member in members)
        reasons = "; ".join(left_out)
        raise FlexcalError(
            "E-PRIOR-002",
            f"a prior needs at least {FEWEST} calibrated robots of a model, and there are {len(members)}"
            f"{': ' + listed if listed else ''}{f' ({reasons})' if reasons else ''}; fewer do not tell how much robots differ.",
        )
    first = members[0]
    for member in members:
        member.require_model_of(first)
        if member.has_prior:
            raise FlexcalError(
                "E-PRIOR-005",
                f"{member.name} was calibrated with a prior of other robots, which would count twice; calibrate it without --prior, on "
                "enough poses, or leave it out.",
            )


def _kind(model: RobotModel, name: str) -> str:
    """Parameters whose spreads resemble each other: errors of one sort and unit."""
    key, unit = name.rpartition(".")[2], unit_in(model, name)
    for kind in ("length", "origin", "misalignment", "gravity_compliance_", "ratio"):
        if key.startswith(kind):
            return f"{'length' if kind == 'origin' else kind}, {unit}"
    return f"{key}, {unit}"
