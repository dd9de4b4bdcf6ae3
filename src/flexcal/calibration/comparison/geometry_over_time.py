"""Change of a robot's geometry over three calibrations or more: along a line, or in a step between two of them.

Single parameters are known far worse than the combinations that the measurements determine, and a shift of one is taken up by several. So
the calibrations are compared as `geometry_change` does, in positions of the tool at common poses, without what another place of the robot,
of the instrument or of a point on the tool looks like.
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
from flexcal.calibration.comparison.explanations import Explanation, candidates_of, explain
from flexcal.calibration.comparison.model_covariance import (
    common_targets,
    estimated,
    is_geometric,
    place_of,
    size_of,
    split_of,
    waves_of,
)
from flexcal.calibration.comparison.thermal_growth import (
    GROWTH,
    ThermalGrowth,
    growth_columns,
    temperature_of,
)
from flexcal.calibration.comparison.undeclared_load import load_explains
from flexcal.calibration.measurement import random_poses, sag_columns, seen_from_base, with_load_at
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.model.robot import RobotModel, unit_in

_POSES = 100
_RANK = 1e-7
"""Relative singular value below which parameters move no point."""
_FLOOR = 1e-6
"""Root mean square displacement, m, that counts as none: second-order terms, and rounding of controllers."""
_KNOWN_SHARE = 0.5
"""Largest share of the variance by what was known beforehand of a combination whose trend is tested."""
_OF_THE_TOOL = ("tool.", "point.", "payload.")


@dataclass(frozen=True, eq=False)
class GeometryTrend:
    """Course of a robot's geometry over K calibrations, a straight line or a step.

    Attributes
    ----------
    change : ndarray
        Change (m,) from the first to the last by the course, in the combinations of parameters that all determine, over their standard
        deviations by the estimates' covariances (whitened).
    residual : float
        Sum of squares of the calibrations about the course, whitened, of (K − 2) m degrees of freedom where the covariances are right.
    visits : int
        K.
    freedom : float
        Degrees of freedom of the fits.
    names : tuple of str
        Parameters of joints that may have caused a change, and the relative growth of all lengths (`GROWTH`).
    units : tuple of str
        Their units.
    map : ndarray
        Derivatives (m, p) of `change` by these, natural units.
    jacobian : ndarray
        Derivatives (3 N, p) of the tool's positions in the base frame by these at N common poses, but for a motion of the whole robot.
    sag : ndarray
        Derivatives (m, n) of `change` by what each joint yields to a load on the tool that was not declared.
    temperatures : ndarray or None
        Temperatures (K,), °C, that the lengths of the calibrations are of; None where one is not known.
    expansion : tuple of float or None
        Expansion of all lengths, 1/K, by these temperatures if nothing else changed, and its standard deviation.
    """

    change: np.ndarray
    residual: float
    visits: int
    freedom: float
    names: tuple[str, ...]
    units: tuple[str, ...]
    map: np.ndarray
    jacobian: np.ndarray
    sag: np.ndarray
    temperatures: np.ndarray | None = None
    expansion: tuple[float, float] | None = None

    @property
    def statistic(self) -> float:
        """Sum of squares of `change`: χ² of m degrees of freedom where nothing changed and the covariances are right."""
        return float(self.change @ self.change)

    def explained(self, scale: float, freedom: float) -> tuple[Explanation, ...]:
        """Fewest changes of parameters from the first to the last calibration that explain the change, with variances `scale` times those
        of the covariances, known with so many degrees of freedom.
        """
        size = np.sqrt(scale)
        return explain(self.change / size, candidates_of(self.names, self.map / size, {}), freedom)

    def is_load(self, explanations: Sequence[Explanation], scale: float, freedom: float) -> bool:
        """Whether a load that was not declared explains the change about as well as these explanations."""
        size = np.sqrt(scale)
        rows = [self.names.index(name) for item in explanations for name in item.names]
        return load_explains(self.change / size, self.sag / size, self.map[:, rows] / size, freedom)

    def displacement(
        self, explanations: Sequence[Explanation], scale: float
    ) -> tuple[float, float, float] | None:
        """Mean distance, m, by which explained changes move the tool, its standard deviation, and the largest at any of the poses; None
        without explanations.
        """
        if not explanations:
            return None
        rows = [self.names.index(name) for item in explanations for name in item.names]
        change = np.array([value for item in explanations for value in item.change])
        size = np.linalg.norm(self.map[:, rows], axis=0)
        inverse = np.linalg.pinv(self.map[:, rows] / size, rcond=1e-6) / size[:, None]
        moved = (self.jacobian[:, rows] @ change).reshape(-1, 3)
        distance = np.linalg.norm(moved, axis=1)
        direction = moved / np.maximum(distance, 1e-12)[:, None]
        slope = np.einsum("ni,nip->p", direction, self.jacobian[:, rows].reshape(-1, 3, len(rows)))
        std = np.sqrt(scale) * float(np.linalg.norm(slope @ inverse)) / len(distance)
        return float(distance.mean()), std, float(distance.max())


def geometry_courses(
    model: RobotModel, estimates: Sequence[Estimate], times: np.ndarray, *, same_springs: bool
) -> tuple[GeometryTrend, ...]:
    """Linear trend of a robot's geometry over three blocks `calibration` or more, of different measurements at times (K,), and its K − 1
    steps between one calibration and the next.

    `model` is the robot without a calibration, with stiffness and inertia as identified; `same_springs` says whether all had these as
    their prior. Where the temperatures of all calibrations are known, the growth of arm and links with these, as of steel or aluminium, is
    no change. Raises `FlexcalError` where they measured no point in common, or no common joint range.
    """
    limits = common_ranges(model, estimates)
    targets = common_targets(model, estimates)
    if not targets:
        raise FlexcalError(
            "E-CAL-036",
            f"the robot's {len(estimates)} calibrations measured no point in common, so its geometry was not compared over time.",
        )
    nominal = model.with_estimated_springs(estimates[0].values)
    first = estimated(nominal, estimates[0])
    known = first.values
    names = [n for n in moving_names(nominal, estimates) if not n.startswith(_OF_THE_TOOL)]
    drawn = random_poses(nominal, limits, targets, max(_POSES, len(names)))
    at = seen_from_base(first, drawn, jacobians=True)
    rigid = rigid_motions(at.position)
    tools = [_alone(columns(at, place_of(nominal, target)), drawn.target == target) for target in targets]
    gauge = np.linalg.qr(np.hstack([rigid, *tools]))[0]
    whole = columns(at, names)
    jacobian = whole - gauge @ (gauge.T @ whole)
    scale = np.array([size_of(nominal, name) for name in names])
    count = np.sqrt(len(drawn))
    left, sizes, right = np.linalg.svd(jacobian * scale / count, full_matrices=False)
    rank = int(np.sum(sizes > _RANK * sizes[0]))
    by_parameter = sizes[:rank, None] * right[:rank] / scale

    of_tool = {name: value for name, value in known.items() if name.startswith(_OF_THE_TOOL)}
    places = [seen_from_base(estimated(nominal, e).with_values(of_tool), drawn).position for e in estimates]
    moved = [left[:, :rank].T @ ((p - places[0]).ravel() / count) for p in places]
    splits = [split_of(nominal, e, names, estimates, same_springs) for e in estimates]
    noises = [by_parameter @ s.noise @ by_parameter.T + _FLOOR**2 * np.eye(rank) for s in splits]
    apart = {name for e in estimates for name in waves_of(e)}
    sources = _stacked([by_parameter @ s.known for s in splits], [s.sources for s in splits], apart)

    temperatures = _temperatures(estimates)
    grown = growth_columns(first, drawn, at.position)
    reduced = left[:, :rank].T @ (grown - gauge @ (gauge.T @ grown)) / count
    growth = ThermalGrowth.of(temperatures, reduced)

    causes = [
        k for k, name in enumerate(names) if is_geometric(nominal, name) and "transmission_" not in name
    ]
    every = np.column_stack([whole[:, causes], grown[:, 0]])
    free = every - rigid @ (rigid.T @ every)
    by_cause = np.column_stack([by_parameter[:, causes], reduced[:, 0]])
    cause_names = [*(names[k] for k in causes), GROWTH]
    units = [*(unit_in(nominal, names[k]) for k in causes), "1"]
    sag = sag_columns(with_load_at(first, targets[0]), at)
    by_load = left[:, :rank].T @ (sag - gauge @ (gauge.T @ sag)) / count
    expansion = None
    if temperatures is not None and np.ptp(temperatures) > 0:
        change, _, matrix = _change(np.array(moved), noises, sources, temperatures - temperatures.mean())
        of_growth = matrix @ reduced[:, 0]
        size = float(of_growth @ of_growth)
        expansion = float(of_growth @ change) / size, size**-0.5
    freedom = float(sum(e.degrees_of_freedom for e in estimates))

    def along(shape: np.ndarray) -> GeometryTrend:
        """Change by a course of `shape` (K,), which rises by one."""
        change, residual, matrix = _change(
            np.array(moved) - growth.expected, noises, sources, shape - shape.mean(), growth.sources
        )
        by_load_white, matrix = matrix @ by_load, matrix @ by_cause
        own = np.linalg.norm(matrix, axis=0) * 1e-3 > 1.0
        return GeometryTrend(
            change,
            residual,
            len(times),
            freedom,
            tuple(name for name, there in zip(cause_names, own, strict=True) if there),
            tuple(unit for unit, there in zip(units, own, strict=True) if there),
            matrix[:, own],
            free[:, own],
            by_load_white,
            temperatures,
            expansion,
        )

    visit = np.arange(len(times))
    return along(times / np.ptp(times)), *(along(1.0 * (visit > k)) for k in visit[:-1])


def _temperatures(estimates: Sequence[Estimate]) -> np.ndarray | None:
    known = [value for e in estimates if (value := temperature_of(e)) is not None]
    return np.array(known) if len(known) == len(estimates) else None


def _change(
    values: np.ndarray,
    noises: Sequence[np.ndarray],
    sources: np.ndarray,
    span: np.ndarray,
    growth: np.ndarray | None = None,
) -> tuple[np.ndarray, float, np.ndarray]:
    """Whitened change (m,) of values (K, r) along `span` (K,), the sum of squares about it, and the matrix (m, r) that whitens a change.

    `sources` and `growth` are columns (K r, s) of errors that calibrations share; combinations mainly of the `sources` are left out.
    """
    rank = values.shape[1]
    weights = span / (span @ span)
    by_noise = np.einsum("k,kij->ij", weights**2, np.array(noises))
    by_known = np.tensordot(weights, sources.reshape(len(span), rank, sources.shape[1]), axes=1)
    whiten = _well_known(by_noise, by_known @ by_known.T)
    if not len(whiten):
        raise FlexcalError(
            "E-CAL-035",
            "no combination of the robot's parameters was determined by all its calibrations; measure more poses.",
        )
    every = sources if growth is None or not growth.size else np.hstack([sources, growth])
    slope, factor, residual = _line(
        values @ whiten.T, [whiten @ n @ whiten.T for n in noises], _each(whiten, every), span
    )
    return factor @ slope, residual, factor @ whiten


def _line(
    values: np.ndarray, noises: Sequence[np.ndarray], sources: np.ndarray, span: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Generalised least-squares slope (m,) over `span` (K,) of values (K, m), a matrix (m, m) that whitens it, and the residual."""
    from scipy.linalg import block_diag, cholesky, solve_triangular

    size = values.shape[1]
    root = cholesky(block_diag(*noises) + sources @ sources.T, lower=True)
    design = np.kron(np.column_stack([np.ones(len(span)), span]), np.eye(size))
    white = solve_triangular(root, np.column_stack([design, values.ravel()]), lower=True)
    basis, triangle = np.linalg.qr(white[:, :-1])
    coefficients = np.linalg.solve(triangle, basis.T @ white[:, -1])
    rest = white[:, -1] - white[:, :-1] @ coefficients
    # the slope's columns are last, so the triangle's last block is the root of its information
    return coefficients[size:], triangle[size:, size:], float(rest @ rest)


def _well_known(by_noise: np.ndarray, by_known: np.ndarray) -> np.ndarray:
    """Combinations (m, r) whose variance is not mainly of what was known beforehand."""
    values, vectors = np.linalg.eigh(by_noise + by_known)
    white = (vectors / np.sqrt(values)).T
    shares, turns = np.linalg.eigh(white @ by_known @ white.T)
    return turns[:, shares < _KNOWN_SHARE].T @ white


def _stacked(known: Sequence[np.ndarray], sources: Sequence[Sequence[str]], apart: set[str]) -> np.ndarray:
    """Columns (K r, s) of what was known beforehand: one of a source that several calibrations have, one each of those kept `apart`."""
    rank = len(known[0])
    result: dict[tuple[str, int], np.ndarray] = {}
    for number, (block, names) in enumerate(zip(known, sources, strict=True)):
        for column, source in zip(block.T, names, strict=True):
            place = (source, number if source in apart else 0)
            result.setdefault(place, np.zeros((len(known), rank)))[number] += column
    return np.column_stack([np.zeros((len(known) * rank, 0)), *(c.ravel() for c in result.values())])


def _each(whiten: np.ndarray, sources: np.ndarray) -> np.ndarray:
    """Stacked columns in other combinations (m, r)."""
    size, rank = whiten.shape
    blocks = sources.reshape(len(sources) // rank, rank, sources.shape[1])
    return np.einsum("mr,krs->kms", whiten, blocks).reshape(size * len(blocks), sources.shape[1])


def _alone(place: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Columns (3 N, 3) that are of the poses `own` (N,) alone."""
    return place * np.repeat(own, 3)[:, None]
