"""Tolerances of manufacture as the prior of every error, where the poses do not tell all of them far better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexcal.calibration.error_model import SCATTER_SPREAD, USUAL_SCATTER
from flexcal.calibration.fit.elastic_prior import NOTHING_ELASTIC, ElasticPrior
from flexcal.calibration.fit.estimated_tolerances import FACTOR_SPREAD
from flexcal.calibration.fit.point_fit import PointFit
from flexcal.calibration.fit.terms import (
    common_lengths,
    declared_size,
    geometric_parameters,
    moving_joints,
    plausible_size,
)
from flexcal.calibration.kinds import wrong_readings
from flexcal.calibration.measurement import ROBOT, predict_measurements, stated_sigma
from flexcal.data.poses import PoseSet
from flexcal.estimation import RANK_TOLERANCE
from flexcal.model.robot import GEOMETRY, ORIGIN, RobotModel, geometric_errors
from flexcal.model.statics import carried_mass, gravity_torque
from flexcal.progress import silent

LENGTH_TOLERANCE = 5e-4
"""Standard deviation of manufacture, m, of a length before the measurements."""
_SIZES = {"offset": 2e-3, "rad": 1e-3, "m": LENGTH_TOLERANCE}
"""Standard deviations of manufacture before the measurements: of joint zeros, and of other angles and lengths of the joints."""
_YIELD, _SOFTEST = 1e-3, 5e-4
"""Rotation, rad, by which a joint yields under its largest load, and the largest compliance, rad/(N m), before the measurements."""
_LEAST = 3.0
"""Logarithm of the factor by which the scatter may be smaller than usual."""
_SURELY, _UNSEEN = 30.0, 1e-9
"""Information, in that of the prior, from which this changes little, and, in the largest, below which the poses tell nothing."""
_MANY = 4
"""Readings for each parameter from which their scatter is known well enough to say so."""
_WRONG, _PASSES = 5.0, 4
"""Distance of a point, in the median of all, from which it tells nothing of the others, and how often such points are looked for."""
_FAR = 3.5
"""Deviation, in standard deviations of its kind, from which a parameter has one of its own."""
_TOLD = 0.5
"""Standard deviation after the measurements, over that before, below which these tell a parameter."""
_ITERATIONS, _HALVINGS, _DIFFERENCE, _STILL = 50, 20, 1e-5, 1e-10
"""Bounds and steps of the search for the factors; it has converged when half the deviance changes by less than the last."""
_LOUD = 2e-3
"""Scatter, m, from which the search begins too where few readings make errors look like noise, and noise like errors."""
_NOISE = "scatter"
"""Key of the scatter, m, beside the factors."""
_LARGEST = float(np.log(10.0))
"""Logarithm of the largest factor of lengths, 5 mm: with more, contacts fit a robot that is a point."""
_PLACED = 3
"""Number of steps by which cameras and boards are placed."""
_RELEASED = 6
"""Largest number of parameters with a standard deviation of their own."""


def with_tolerance_prior(
    model: RobotModel, poses: PoseSet, terms: Sequence[str]
) -> tuple[RobotModel, dict[str, str]] | None:
    """Robot whose errors of some terms have a prior about nominal: what robot.yaml declares, else tolerances of manufacture, and the
    kinds of those parameters whose tolerances have a factor in common that was estimated here, by name.

    None where points tell all that any poses would so well that these change nothing, and where readings are beyond all numbers.

    Errors of the joints are of four kinds: zeros, other angles, lengths, and compliances. How much larger than the usual ones those of a
    kind are is estimated from the points, by the marginal likelihood with a lognormal prior of a factor of two (empirical Bayes, Morris
    1983); an angle that is then farther off than chance is known to be as far off alone. Places of points and instruments, and further
    terms, have their plausible size.
    """
    # which errors contacts show depends on where the faces are, of which nothing is known yet
    names = (
        *geometric_parameters(model, poses, terms).names,
        *geometric_errors(model, moving_joints(model, poses)),
    )
    free = ("station.", *_of_cameras(model, poses))
    open_ = [n for n in names if declared_size(model, n) is None and not n.startswith(free)]
    kinds = {name: error_kind(model, name) for name in open_}
    sizes = _usual_sizes(model, poses, kinds)
    first = model.with_priors(sizes)
    elastic = bool(model.elastic)
    prior = ElasticPrior.of(first, poses) if elastic else NOTHING_ELASTIC
    fit = PointFit.of(
        first, poses, tuple(terms), prior, elastic, marginalised=False, near={}, progress=silent
    )
    evidence = _Evidence.of(fit, kinds)
    if not np.isfinite(evidence.gram).all() or not np.isfinite(evidence.along).all():
        return None
    factors = evidence.factors({})
    for _ in range(_PASSES):
        if not (wrong := evidence.wrong(factors)).any():
            break
        evidence = evidence.without(wrong)
        factors = evidence.factors({})
    own: dict[str, float] = {}
    while len(own) < _RELEASED and (far := evidence.farthest(factors, own)):
        own[far[0]] = far[1]
        factors = evidence.factors(own)
    if are_tracked(poses) and not fit.hidden and evidence.tells_all(factors, own):
        return None
    scaled = {name: size * factors.get(kinds[name], 1.0) for name, size in sizes.items()}
    shared = {name: kind for name, kind in kinds.items() if kind and name not in own}
    return model.with_priors(scaled | own), shared


def are_tracked(poses: PoseSet) -> bool:
    """Whether an instrument measured all poses as points, whose lengths need no prior."""
    return bool((poses.located & ~poses.seen).all())


def _of_cameras(model: RobotModel, poses: PoseSet) -> tuple[str, ...]:
    """Beginnings of the names of parameters that place what the robot carries of cameras and boards, which the views find anywhere."""
    seen = dict.fromkeys(poses.target[poses.seen].tolist())
    return tuple("tool.length" if target == model.tool_point else f"point.{target}." for target in seen)


def error_kind(model: RobotModel, name: str) -> str:
    """Kind of a parameter that shares a factor with others, or none."""
    owner, _, key = name.rpartition(".")
    if key.startswith("gravity_compliance"):
        return "compliance"
    if key not in (*GEOMETRY, *ORIGIN):
        return ""
    length = key in ORIGIN or key.startswith("length")
    if owner == "tool":
        return "" if length else "rad"
    if length:
        return "m"
    # rotations of a joint at the base take up that of the first instrument
    at_base = model.joints[model.joint_index(owner)].parent < 0
    return "" if at_base else "offset" if key == "offset" else "rad"


def _usual_sizes(model: RobotModel, poses: PoseSet, kinds: dict[str, str]) -> dict[str, float]:
    """Standard deviations, natural units, of parameters before the measurements."""
    load = np.abs(gravity_torque(model, poses.q, carried_mass(model, poses.payload, len(poses)))).max(axis=0)
    sizes = {}
    for name, kind in kinds.items():
        if kind == "compliance" and name.endswith("gravity_compliance"):
            own = load[model.joint_index(name.partition(".")[0])]
            sizes[name] = min(_SOFTEST, _YIELD / max(own, 1e-9))
        else:
            sizes[name] = _SIZES.get(kind) or plausible_size(model, name)
    return sizes


def _placed(fit: PointFit) -> RobotModel:
    """The nominal robot with cameras and boards by least squares, which their linear start values only come near."""
    start, poses = fit.start, fit.poses
    names = tuple(item.name for item in fit.free if not np.isfinite(item.prior_std))
    for _ in range(_PLACED if poses.seen.any() else 0):
        at = predict_measurements(start, poses, elastic=fit.elastic, jacobians=True)
        weight = 1 / np.hypot(USUAL_SCATTER[ROBOT], at.readings.sigma)
        columns = (weight[:, :, None] * at.jacobian(names)).reshape(-1, len(names))
        step = np.linalg.lstsq(columns, (weight * at.residual).ravel(), rcond=RANK_TOLERANCE)[0]
        changed = zip(names, step.tolist(), strict=True)
        start = start.with_values({name: start.value(name) + change for name, change in changed})
    return start


@dataclass(frozen=True, eq=False)
class _Evidence:
    """Marginal likelihood of linear readings y = A x + e, x in prior standard deviations.

    `names` of the parameters, `kinds` those with a common factor, `sizes` (p,) their standard deviations; `usual` scatter, m, `readings`
    (n,) y and `columns` (n, p) A, m, of the `points` (n,); the place of instruments is projected off them by the `basis` (n, k).
    """

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    sizes: np.ndarray
    usual: float
    points: np.ndarray
    readings: np.ndarray
    columns: np.ndarray
    basis: np.ndarray

    @classmethod
    def of(cls, fit: PointFit, kinds: dict[str, str]) -> _Evidence:
        start, free = _placed(fit), fit.free
        at = predict_measurements(start, fit.poses, elastic=fit.elastic, jacobians=True)
        distance = np.linalg.norm(at.residual[: len(fit.poses)], axis=1)
        right = ~wrong_readings(distance)[at.readings.row]
        there = (at.readings.present & right[:, None]).ravel()
        known = np.isfinite(free.prior_std())
        sizes = np.where(known, free.prior_std(), 1.0)
        columns = at.jacobian(free.names).reshape(-1, len(free))[there] * sizes
        # a rad counts as the reach of the arm
        unit = np.repeat(np.where(at.readings.points, 1.0, fit.start.reach), 3)[there]
        y = at.residual.ravel()[there] * unit
        columns *= unit[:, None]
        usual = float(np.hypot(USUAL_SCATTER[ROBOT], stated_sigma(at.readings)))
        weight = usual / np.hypot(USUAL_SCATTER[ROBOT], at.readings.sigma.ravel()[there] * unit)
        y, columns = weight * y, weight[:, None] * columns
        # all lengths may be off in common, whatever the tolerance of each
        common = start.prior.scale * common_lengths(start, free) / sizes
        columns = np.column_stack([columns, columns @ common])
        # where instruments stand is free: restricted likelihood of what that leaves
        basis, lengths, _ = np.linalg.svd(columns[:, np.append(~known, False)], full_matrices=False)
        basis = basis[:, lengths > RANK_TOLERANCE * lengths.max(initial=0.0)]
        columns = columns[:, np.append(known, True)]
        y, columns = y - basis @ (basis.T @ y), columns - basis @ (basis.T @ columns)
        names = (*(p.name for p in free if np.isfinite(p.prior_std)), "scale")
        own, sizes = tuple(kinds.get(name, "") for name in names), np.append(sizes[known], 1.0)
        points = np.repeat(np.arange(len(at.residual)), 3)[there]
        return cls(names, own, sizes, usual, points, y, columns, basis)

    @cached_property
    def gram(self) -> np.ndarray:
        """AᵀA (p, p)."""
        return self.columns.T @ self.columns

    @cached_property
    def along(self) -> np.ndarray:
        """Aᵀy (p,)."""
        return self.columns.T @ self.readings

    @cached_property
    def square(self) -> float:
        """yᵀy."""
        return float(self.readings @ self.readings)

    @property
    def count(self) -> int:
        """Number of readings beyond those that place the instruments."""
        return len(self.readings) - self.basis.shape[1]

    def wrong(self, factors: dict[str, float]) -> np.ndarray:
        """Mask (n,) of the readings of points that are far farther off than most."""
        scale = self._scales(factors, {})
        told = scale[:, None] * self.gram * scale + factors[_NOISE] ** 2 * np.eye(len(scale))
        left = self.readings - self.columns @ (scale * np.linalg.solve(told, scale * self.along))
        distance = np.sqrt(np.bincount(self.points, left**2))
        return distance[self.points] > _WRONG * np.median(distance[np.unique(self.points)])

    def without(self, rows: np.ndarray) -> _Evidence:
        """The same of all but some readings, a mask (n,), which nothing explains."""
        eye = -self.basis @ self.basis[rows].T
        eye[np.flatnonzero(rows), np.arange(eye.shape[1])] += 1.0
        basis = np.linalg.qr(eye)[0]
        y, columns = (a - basis @ (basis.T @ a) for a in (self.readings, self.columns))
        return replace(self, readings=y, columns=columns, basis=np.column_stack([self.basis, basis]))

    def tells_all(self, factors: dict[str, float], own: dict[str, float]) -> bool:
        """Whether the readings tell every combination of errors that they tell at all far better than the prior."""
        if self._few:
            return False
        scale = self._scales(factors, own)
        told = scale[:, None] * self.gram * scale / factors[_NOISE] ** 2
        kept = np.array([bool(kind) for kind in self.kinds])
        across = told[np.ix_(~kept, kept)]
        taken = across.T @ np.linalg.pinv(told[np.ix_(~kept, ~kept)], hermitian=True) @ across
        information = np.linalg.eigvalsh(told[np.ix_(kept, kept)] - taken)
        return not np.any((information > _UNSEEN * information[-1]) & (information < _SURELY))

    @property
    def _few(self) -> bool:
        """Whether there are too few readings to tell their scatter from errors of the joints for sure."""
        return self.count < _MANY * len(self.names)

    @property
    def shared(self) -> tuple[str, ...]:
        """Kinds of errors with a factor."""
        return tuple(dict.fromkeys(kind for kind in self.kinds if kind))

    def factors(self, own: dict[str, float]) -> dict[str, float]:
        """Most probable factor of every kind, some parameters having standard deviations of their `own`."""
        starts = (self.usual, max(self.usual, _LOUD)) if self._few else (self.usual,)
        x = min((self._search(np.log(start), own) for start in starts), key=lambda found: found[0])[1]
        named = dict(zip(self.shared, np.exp(x[:-1]).tolist(), strict=True))
        return named | {_NOISE: float(np.exp(x[-1]))}

    def _search(self, noise: float, own: dict[str, float]) -> tuple[float, np.ndarray]:
        """Smallest cost, and the log factors and log scatter where it is, from usual factors and the log scatter `noise`."""
        x = np.append(np.zeros(len(self.shared)), noise)
        lower = np.append(np.full(len(self.shared), -4.0), np.log(self.usual) - _LEAST)
        upper = np.array([*(_LARGEST if kind == "m" else 6.0 for kind in self.shared), 0.0])
        cost, slope = self._cost(x, own)
        for _ in range(_ITERATIONS):
            # Newton's steps, with the second derivatives by differences of the first
            ahead = np.array([self._cost(x + step, own)[1] for step in _DIFFERENCE * np.eye(len(x))])
            bend = (ahead - slope) / _DIFFERENCE
            moving = ~(((x <= lower) & (slope > 0)) | ((x >= upper) & (slope < 0)))
            sizes, axes = np.linalg.eigh((bend + bend.T)[np.ix_(moving, moving)] / 2)
            step = np.zeros(len(x))
            step[moving] = -axes @ ((axes.T @ slope[moving]) / np.maximum(np.abs(sizes), 1.0))
            step *= min(1.0, 2.0 / max(np.abs(step).max(), 1e-12))
            for _ in range(_HALVINGS):
                tried = np.clip(x + step, lower, upper)
                expected = float(slope @ (tried - x))
                after = self._cost(tried, own)
                if after[0] <= cost + 1e-4 * expected:
                    break
                step /= 2
            else:
                break
            x, (cost, slope) = tried, after
            if -expected < _STILL:
                break
        return cost, x

    def farthest(self, factors: dict[str, float], own: dict[str, float]) -> tuple[str, float] | None:
        """Angle of a joint that is farther off than its kind explains, with its deviation."""
        scale = self._scales(factors, own)
        noise = factors[_NOISE] ** 2
        inner = np.linalg.inv(scale[:, None] * self.gram * scale / noise + np.eye(len(scale)))
        mean, std = inner @ (scale * self.along) / noise, np.sqrt(np.diag(inner))
        open_ = [
            k
            for k, kind in enumerate(self.kinds)
            if kind in ("offset", "rad")
            and self.names[k] not in own
            and std[k] < _TOLD
            and abs(mean[k]) > _FAR
        ]
        if not open_:
            return None
        k = max(open_, key=lambda k: abs(mean[k]))
        return self.names[k], float(abs(mean[k]) * scale[k] * self.sizes[k])

    def _scales(self, factors: dict[str, float], own: dict[str, float]) -> np.ndarray:
        return np.array(
            [
                own[name] / size if name in own else factors.get(kind, 1.0)
                for name, kind, size in zip(self.names, self.kinds, self.sizes, strict=True)
            ]
        )

    def _cost(self, x: np.ndarray, own: dict[str, float]) -> tuple[float, np.ndarray]:
        """Half the deviance of log factors and the log scatter `x`, and its gradient."""
        scale = self._scales(dict(zip(self.shared, np.exp(x[:-1]).tolist(), strict=True)), own)
        noise = np.exp(2 * x[-1])
        along, square = scale * self.along / noise, self.square / noise
        told = scale[:, None] * self.gram * scale / noise
        # a little more than one, or rounding of readings without noise would make it indefinite
        lower = np.linalg.cholesky(told + (1.0 + 1e-13 * np.trace(told)) * np.eye(len(scale)))
        inverse = np.linalg.inv(lower)
        mean, variance = inverse.T @ (inverse @ along), (inverse**2).sum(axis=0)
        scatter = (x[-1] - np.log(self.usual)) / SCATTER_SPREAD
        cost = 0.5 * (square - along @ mean) + np.log(np.diag(lower)).sum() + self.count * x[-1]
        told = 1 - variance - mean**2
        gradient = [
            sum(
                told[i]
                for i, (n, k) in enumerate(zip(self.names, self.kinds, strict=True))
                if k == kind and n not in own
            )
            for kind in self.shared
        ]
        last = along @ mean - square - told.sum() + self.count
        last += 2 * scatter / (1 + scatter**2) / SCATTER_SPREAD
        slope = np.append(np.array(gradient) + x[:-1] / FACTOR_SPREAD**2, last)
        return float(cost + 0.5 * np.sum((x[:-1] / FACTOR_SPREAD) ** 2) + np.log1p(scatter**2)), slope
