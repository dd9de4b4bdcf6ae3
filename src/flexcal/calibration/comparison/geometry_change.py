"""Change of a robot's geometry between two calibrations.

Two fits hold and drop different parameters, and their instruments stand elsewhere. Positions of the tool in the base frame, but for a
motion of the whole robot, do not depend on either: there the two are compared, and the changes of parameters follow from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.comparison.common_poses import (
    columns,
    common_ranges,
    moving_names,
    rigid_motions,
)
from flexcal.calibration.comparison.explanations import LEVEL, Explanation, candidates_of, chance_of, explain
from flexcal.calibration.comparison.joint_covariance import difference_of_known
from flexcal.calibration.comparison.model_covariance import (
    common_targets,
    estimated,
    is_geometric,
    place_of,
    root_of,
    size_of,
    split_of,
    targets_of,
    waves_of,
)
from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import plausible_size
from flexcal.calibration.measurement import random_poses, seen_from_base
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate, analyse
from flexcal.model.robot import RobotModel, unit_in

_POSES = 200
_RANK = 1e-7
"""Relative singular value below which parameters move no point."""
_FLOOR = 1e-6
"""Root mean square displacement, m, that counts as none: second-order terms of the difference, and rounding of controllers."""
_KNOWN_SHARE = 0.5
"""Largest share of the variance by what was known beforehand of a combination that both calibrations determine."""
_TOLD = 1e-3
"""Standard deviation, rad or m, above which a change of a single parameter is no information."""


@dataclass(frozen=True)
class ParameterShift:
    """Change of a parameter from the first to the second calibration, natural units, of those that it is compared with in one gauge.

    It is of the combination of the parameter with those of `absorbed`, which take its place in other gauges. `probability` of a change as
    large by chance, and `adjusted` for the number of parameters (Holm 1979).
    """

    name: str
    unit: str
    change: float
    std: float
    probability: float
    adjusted: float
    absorbed: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class GeometryChange:
    """Change of the geometry from one calibration to another.

    Attributes
    ----------
    q : ndarray
        Random joint positions (N, n) within the ranges of both, rad or m.
    target : ndarray
        Names (N,) of the points on the tool.
    points : ndarray
        Their positions (N, 3) by the first calibration, base frame, m.
    displacement : ndarray
        How far each moved (N, 3), base frame, m, after the best-fit motion of the whole robot, which instruments elsewhere cannot tell
        from a change, was taken out.
    std : ndarray
        Standard deviation (N,) of the displacement's size in all three directions together, m: the root of the summed variances.
    ranges : ndarray
        Lower and upper joint positions (2, n) that both calibrations cover.
    statistic : float
        χ² of the difference in the combinations of parameters that both determine.
    combinations : int
        Their number.
    freedom : float
        Degrees of freedom of the noise behind the covariances.
    probability : float
        Probability that chance makes the difference as large.
    shifts : tuple of ParameterShift
        Changes of a set of parameters for these combinations, the most significant first.
    explanations : tuple of Explanation
        Fewest changes that explain the difference.
    """

    q: np.ndarray
    target: np.ndarray
    points: np.ndarray
    displacement: np.ndarray
    std: np.ndarray
    ranges: np.ndarray
    statistic: float
    combinations: int
    freedom: float
    probability: float
    shifts: tuple[ParameterShift, ...]
    explanations: tuple[Explanation, ...]

    @property
    def distance(self) -> np.ndarray:
        """Sizes (N,) of the displacements, m."""
        return np.linalg.norm(self.displacement, axis=1)

    @property
    def changed(self) -> bool:
        """Whether the difference is beyond chance, at 5 %."""
        return self.probability < LEVEL

    @property
    def statistics(self) -> ErrorStatistics:
        """Mean, P90 and maximum of the displacements."""
        return ErrorStatistics.of(self.displacement)


def compare_geometry(
    model: RobotModel,
    first: Estimate,
    second: Estimate,
    *,
    declared: RobotModel | None = None,
    same_springs: bool = False,
    poses: int = _POSES,
) -> GeometryChange:
    """Change of a robot's geometry from one block `calibration` to another.

    Parameters
    ----------
    model : RobotModel
        Robot without a calibration, from which the first began, with stiffness and inertia as identified.
    first, second : Estimate
        The calibrations, of different measurements.
    declared : RobotModel, optional
        The same of the second where its points were declared elsewhere; by default `model`.
    same_springs : bool
        Whether both had the stiffness and inertia of `model` as their prior, whose errors are then the same in both.
    poses : int
        Number of random poses within the joint ranges of both, for every point.

    Returns
    -------
    GeometryChange
        Verdict, parameters and displacements.

    Raises
    ------
    FlexcalError
        Where the two measured no point in common, or no common joint range.
    """
    pair = (first, second)
    targets = _targets(model, pair)
    limits = common_ranges(model, pair)
    nominal = model.with_estimated_springs(first.values)
    names = moving_names(nominal, pair)
    drawn = random_poses(nominal, limits, targets, poses)
    robots = [estimated(nominal, first), estimated(declared or nominal, second)]
    places = [seen_from_base(robot, drawn).position for robot in robots]
    gauge = rigid_motions(places[0])
    jacobian = columns(seen_from_base(nominal, drawn, jacobians=True), names)
    jacobian = jacobian - gauge @ (gauge.T @ jacobian)
    moved = (places[1] - places[0]).ravel()
    moved = moved - gauge @ (gauge.T @ moved)

    splits = [split_of(nominal, estimate, names, pair, same_springs) for estimate in pair]
    # the size of the waves is itself estimated from the points, so what is known of them does not cancel
    known = difference_of_known(*splits, apart=[*waves_of(first), *waves_of(second)])
    noise = splits[0].noise + splits[1].noise
    spread = jacobian @ np.hstack([root_of(noise), known])
    variance = (spread**2).sum(axis=1).reshape(-1, 3).sum(axis=1)

    scale = np.array([size_of(nominal, name) for name in names])
    test = _Test.of(
        jacobian / np.sqrt(len(drawn)),
        moved / np.sqrt(len(drawn)),
        scale,
        [s.noise for s in splits],
        known,
        pair,
    )
    own = [name for name in names if is_geometric(nominal, name) and "transmission_" not in name]
    matrix = test.map[:, [names.index(name) for name in own]]
    seen = (
        np.linalg.norm(matrix, axis=0)
        * [1.0 if unit_in(nominal, n) not in ("m", "rad") else _TOLD for n in own]
        > 1.0
    )
    named = [name for name, there in zip(own, seen, strict=True) if there]
    matrix = matrix[:, seen]
    candidates = candidates_of(named, matrix, {t: place_of(nominal, t) for t in targets})
    statistic = float(test.difference @ test.difference)
    probability = chance_of(statistic, len(test.difference), test.freedom)
    explanations = explain(test.difference, candidates, test.freedom) if probability < LEVEL else ()
    return GeometryChange(
        q=drawn.q,
        target=drawn.target,
        points=places[0],
        displacement=moved.reshape(-1, 3),
        std=np.sqrt(variance),
        ranges=limits,
        statistic=statistic,
        combinations=len(test.difference),
        freedom=test.freedom,
        probability=probability,
        shifts=_shifts(
            nominal, named, matrix, test, [*(n for e in explanations for n in e.names), *_both(named, pair)]
        ),
        explanations=explanations,
    )


@dataclass(frozen=True, eq=False)
class _Test:
    """Whitened `difference` (m,) in the combinations that both determine, and its derivatives `map` (m, p) by all parameters."""

    difference: np.ndarray
    map: np.ndarray
    freedom: float

    @classmethod
    def of(
        cls,
        jacobian: np.ndarray,
        moved: np.ndarray,
        scale: np.ndarray,
        noises: Sequence[np.ndarray],
        known: np.ndarray,
        pair: Sequence[Estimate],
    ) -> _Test:
        left, sizes, right = np.linalg.svd(jacobian * scale, full_matrices=False)
        rank = int(np.sum(sizes > _RANK * sizes[0]))
        by_parameter = sizes[:rank, None] * right[:rank] / scale
        by_noise = [by_parameter @ noise @ by_parameter.T for noise in noises]
        by_known = (by_parameter @ known) @ (by_parameter @ known).T
        whole = by_noise[0] + by_noise[1] + by_known + _FLOOR**2 * np.eye(rank)
        values, vectors = np.linalg.eigh(whole)
        white = (vectors / np.sqrt(values)).T
        shares, turns = np.linalg.eigh(white @ by_known @ white.T)
        white = turns[:, shares < _KNOWN_SHARE].T @ white
        parts = [float(np.trace(white @ noise @ white.T)) / max(len(white), 1) for noise in by_noise]
        inverse = sum(p**2 / max(e.degrees_of_freedom, 1) for p, e in zip(parts, pair, strict=True))
        freedom = sum(parts) ** 2 / inverse if inverse > 0 else np.inf
        return cls(white @ (left[:, :rank].T @ moved), white @ by_parameter, float(freedom))


def _shifts(
    model: RobotModel, names: list[str], matrix: np.ndarray, test: _Test, prefer: list[str]
) -> tuple[ParameterShift, ...]:
    """Changes of parameters in one gauge, of which those that `prefer` names come first."""
    from scipy.stats import t

    if not len(names) or not len(matrix):
        return ()
    scale = np.array([plausible_size(model, name) for name in names])
    gauge = analyse(matrix, names, scale=scale, prefer=list(dict.fromkeys(prefer)), tolerance=1e-6)
    kept = list(gauge.kept)
    size = np.linalg.norm(matrix[:, kept], axis=0)
    inverse = np.linalg.pinv(matrix[:, kept] / size, rcond=1e-9)
    change, std = inverse @ test.difference / size, np.linalg.norm(inverse, axis=1) / size
    chances = 2 * t.sf(np.abs(change / std), test.freedom)
    order = np.argsort(chances)
    adjusted = np.empty(len(order))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(chances[order] * np.arange(len(order), 0, -1)))
    absorbed = {names[k]: [] for k in kept}
    for item in gauge.dropped:
        for name, coefficient in item.absorbed_by:
            relative = abs(coefficient) * scale[names.index(item.name)] / scale[names.index(name)]
            if relative > 0.05:
                absorbed[name].append(item.name)
    return tuple(
        ParameterShift(
            names[kept[k]],
            unit_in(model, names[kept[k]]),
            float(change[k]),
            float(std[k]),
            float(chances[k]),
            float(adjusted[k]),
            tuple(absorbed[names[kept[k]]]),
        )
        for k in order
    )


def _both(names: Sequence[str], pair: Sequence[Estimate]) -> list[str]:
    """Names that both fits kept."""
    return [n for n in names if all(n in e.parameters and e.std(n) for e in pair)]


def _targets(model: RobotModel, pair: Sequence[Estimate]) -> list[str]:
    common = common_targets(model, pair)
    if not common:
        first, second = (", ".join(targets_of(model, estimate)) for estimate in pair)
        raise FlexcalError(
            "E-CAL-033",
            f"the two calibrations measured no point in common ({first}; {second}), so they cannot be compared.",
        )
    return common
