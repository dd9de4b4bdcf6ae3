"""Optimisation problem of an exciting trajectory: information of motor torques within all limits of joints, drives, point, bodies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from flexcal.design.scene import Clearance
from flexcal.design.trajectories.interior_point import BarrierValue
from flexcal.design.trajectories.limit_usage import MotionLimits
from flexcal.design.trajectories.motion_space import MotionSpace
from flexcal.design.trajectories.regressor_columns import BaseRegressor
from flexcal.model.kinematics import point_kinematics

NEAR = 0.05
"""Distance beyond the margin, m, below which a pair of shapes is monitored."""
_SLACK = 2e-4
"""Distance beyond the margin, m, that bodies keep at the instants of a grid, for the motion in between."""
_EDGE = 1e-3
"""Share of a limit kept free where it was passed between the instants."""


@dataclass(frozen=True, eq=False)
class LimitViolation:
    """Largest `uses` (4, n) of position, velocity, acceleration and torque, share that the `point` is beyond, m that `distance` lacks."""

    uses: np.ndarray
    point: float
    distance: float


class Merit(Protocol):
    """A merit, larger is better, of the information (r, r) on the base columns, and its derivative by that."""

    def merit(self, information: np.ndarray) -> float: ...

    def gradient(self, information: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class ExcitationProblem:
    """A motion of `space` that makes `merit` large and keeps `limits`; `weights` (n,) are 1/σ of the torques."""

    space: MotionSpace
    columns: BaseRegressor
    merit: Merit
    weights: np.ndarray
    limits: MotionLimits
    clearance: Clearance

    def information(self, motion: np.ndarray) -> np.ndarray:
        """Mean information (r, r) of an instant."""
        return self._information(self.columns.write(motion))

    def _information(self, columns: np.ndarray) -> np.ndarray:
        weighted = columns * self.weights[:, None, None]
        return np.sum(weighted @ weighted.transpose(0, 2, 1), axis=0) / columns.shape[2]

    def evaluate(self, x: np.ndarray, barrier: float) -> BarrierValue:
        """Minus the merit, and the barrier of all limits, each counted by its mean over the instants."""
        motion = self.space.motion(x)
        q = motion[0]
        outside = BarrierValue(np.inf, lambda: np.zeros(x.size), lambda v: v)
        linear = self._linear_uses(motion)
        if np.abs(linear).max() >= 1:
            return outside
        columns = self.columns.write(motion)
        uses = (*linear, self._torque_use(columns))
        point = _Point.of(self.columns, self.limits, motion)
        if np.abs(uses[-1]).max() >= 1 or (point.constraints >= 0).any():
            return outside
        instants, distances, nearing = self.clearance.near(q, 0.0)
        if (distances <= 0).any():
            return outside
        merit = self.merit.merit(information := self._information(columns))
        if not np.isfinite(merit):
            return outside
        closeness = distances / NEAR
        room = sum(np.sum(np.log1p(-(use**2))) for use in uses) + np.sum(np.log(-point.constraints))
        room += np.sum(np.log(closeness) + (1 - closeness) + (1 - closeness) ** 2 / 2)
        share = barrier / len(q)

        def gradient() -> np.ndarray:
            position, velocity, acceleration, torque = (share * 2 * use / (1 - use**2) for use in uses)
            slope = -2 / len(q) * self.merit.gradient(information)
            by_columns = (self.weights**2)[:, None, None] * (slope @ columns)
            by_columns += self.columns.smooth_values[:, None] * (torque / self._drive_share).T[:, None]
            by_motion = self.columns.by_motion(motion, by_columns)
            by_motion[0] += position / self._half
            by_motion[1] += velocity / self.limits.velocity
            by_motion[2] += acceleration / self.limits.acceleration
            by_motion += point.by_motion(-share / point.constraints)
            pull = -share * (1 / closeness - 1 - (1 - closeness)) / NEAR
            np.add.at(by_motion[0], instants, pull[:, None] * nearing)
            return self.space.by_coordinates(by_motion)

        bend = [share * 2 * (1 + use**2) / (1 - use**2) ** 2 for use in uses[:3]]
        weights = (
            bend[0] / self._half**2,
            bend[1] / self.limits.velocity**2,
            bend[2] / self.limits.acceleration**2,
        )
        return BarrierValue(-merit - share * float(room), gradient, self.space.solver(np.array(weights)))

    def within(self, x: np.ndarray) -> bool:
        """Whether the motion is inside all limits at all instants."""
        return bool(np.isfinite(self.evaluate(x, 1.0).value))

    @property
    def _half(self) -> np.ndarray:
        return (self.limits.upper - self.limits.lower) / 2

    @property
    def _drive_share(self) -> np.ndarray:
        """Motor torques (n,) available after Coulomb friction."""
        return self.limits.torque - np.nan_to_num(self.columns.model.drives.coulomb)

    def uses(self, motion: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Fraction (4, N, n) of the limits of positions, velocities, accelerations and motor torques, between -1 and 1."""
        return np.array([*self._linear_uses(motion), self._torque_use(columns)])

    def _linear_uses(self, motion: np.ndarray) -> np.ndarray:
        middle = (self.limits.upper + self.limits.lower) / 2
        room = np.array([self._half, self.limits.velocity, self.limits.acceleration])
        return (motion - np.array([middle, 0 * middle, 0 * middle])[:, None]) / room[:, None]

    def _torque_use(self, columns: np.ndarray) -> np.ndarray:
        return np.einsum("jrn,r->nj", columns, self.columns.smooth_values) / self._drive_share

    def excess(self, x: np.ndarray) -> LimitViolation | None:
        """Limit violation of a motion at its worst instants; None if it keeps all limits."""
        motion = self.space.motion(x)
        uses = [np.abs(use).max(axis=0) for use in self.uses(motion, self.columns.write(motion))]
        point = _Point.of(self.columns, self.limits, motion).constraints.max(initial=-1.0)
        distance = self.clearance.near(motion[0])[1].min(initial=NEAR)
        if max(use.max() for use in uses) < 1 and point < 0 and distance > _SLACK:
            return None
        return LimitViolation(
            np.maximum(np.array(uses), 1 - _EDGE), max(float(point), -_EDGE), max(_SLACK - distance, 0.0)
        )

    def kept_by(self, x: np.ndarray) -> bool:
        """Whether a motion passes no limit."""
        return self.excess(x) is None

    def tightened(self, excess: LimitViolation) -> ExcitationProblem:
        """Problem with limits reduced by the violation, and a little more."""
        limits, shrink = self.limits, (1 - _EDGE) / excess.uses
        middle, half = (limits.upper + limits.lower) / 2, self._half * shrink[0]
        box, inset = limits.box, np.array([[1.0], [-1.0]]) * (excess.point + _EDGE)
        smaller = replace(
            limits,
            lower=middle - half,
            upper=middle + half,
            velocity=limits.velocity * shrink[1],
            acceleration=limits.acceleration * shrink[2],
            torque=limits.torque - self._drive_share * (1 - shrink[3]),
            box=box + inset * np.where(np.isfinite(box).all(axis=0), np.ptp(box, axis=0), 1.0),
            speed=limits.speed * (1 - excess.point - _EDGE),
        )
        margin = excess.distance + _EDGE * NEAR if excess.distance > 0 else 0.0
        return replace(self, limits=smaller, clearance=self.clearance.wider(margin))

    def standing(self, q: np.ndarray) -> np.ndarray:
        """Excess (N, 3) of a robot at rest at `q` (N, n) over its positions and torques, the box, and collision, negative within."""
        still = np.array([q, 0 * q, 0 * q])
        uses = self.uses(still, self.columns.write(still))
        point = _Point.of(self.columns, self.limits, still)
        joints = np.max([np.abs(use).max(axis=1) for use in uses], axis=0) - 1
        box = point.constraints[:, :6].max(axis=1, initial=-1.0)
        touching = np.where(self.clearance.checker.collides(q), 0.5, -1.0)
        return np.column_stack([joints, box, touching])

    def standing_limit(self, q: np.ndarray) -> str:
        """Limit that a robot at rest at `q` (n,) exceeds most, in words."""
        model = self.columns.model
        joints, box, touching = self.standing(q[None])[0]
        if touching > max(joints, box):
            pairs = self.clearance.checker.colliding(q)
            return "; ".join(f"{one} touches {other}" for one, other in pairs[:3])
        if box > joints:
            return f"{next(iter(model.points))} is outside the box of `limits:`"
        still = np.array([q, 0 * q, 0 * q])[:, None]
        position, _, _, torque = (use[0] for use in self.uses(still, self.columns.write(still)))
        if np.abs(position).max() > np.abs(torque).max():
            j = int(np.argmax(np.abs(position)))
            return f"{model.joint_names[j]} is at {q[j]:.4g}, outside {self.limits.lower[j]:.4g} to {self.limits.upper[j]:.4g}"
        j = int(np.argmax(np.abs(torque)))
        unit = "N" if model.joints[j].kind == "prismatic" else "N m"
        return (
            f"{model.joint_names[j]} needs {abs(torque[j]) * self._drive_share[j]:.4g} {unit} at rest, but friction leaves "
            f"{self._drive_share[j]:.4g} {unit} of its effort"
        )

    def finer(self, factor: int) -> ExcitationProblem:
        """Problem on a grid of instants finer by this factor."""
        return replace(self, space=self.space.finer(factor), clearance=self.clearance.wider(0.0))


@dataclass(frozen=True, eq=False)
class _Point:
    """The target's box and speed: `constraints` (N, 7) relative to the box and the speed, (N, 0) without such limits."""

    constraints: np.ndarray
    jacobian: np.ndarray
    bent: np.ndarray
    velocity: np.ndarray
    sizes: np.ndarray
    speed: float

    @classmethod
    def of(cls, columns: BaseRegressor, limits: MotionLimits, motion: np.ndarray) -> _Point:
        q, dq, _ = motion
        nothing = np.zeros((len(q), 0))
        if not limits.cartesian:
            return cls(nothing, nothing, nothing, nothing, nothing, limits.speed)
        seen = point_kinematics(columns.model, q)
        moved = seen.motion_jacobian[..., 2]
        jacobian, turning = moved[:, :3], moved[:, 3:]
        velocity = np.einsum("icj,ij->ic", jacobian, dq)
        bent = np.empty_like(jacobian)
        for j in range(q.shape[1]):
            beyond = np.einsum("icj,ij->ic", jacobian[:, :, j:], dq[:, j:])
            before = np.einsum("icj,ij->ic", turning[:, :, :j], dq[:, :j])
            bent[:, :, j] = np.cross(turning[:, :, j], beyond) + np.cross(before, jacobian[:, :, j])
        bounded = np.isfinite(limits.box).all()
        sizes = np.ptp(limits.box, axis=0) if bounded else np.full(3, np.inf)
        sides = np.hstack([limits.box[0] - seen.position, seen.position - limits.box[1]])
        outside = sides / np.tile(sizes, 2) if bounded else np.full_like(sides, -1.0)
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        constraints = np.hstack([outside, speed / limits.speed - 1])
        return cls(
            constraints,
            jacobian,
            bent,
            velocity / np.maximum(speed, 1e-12),
            sizes,
            limits.speed,
        )

    def by_motion(self, slopes: np.ndarray) -> np.ndarray:
        """Derivative (3, N, n) of Σ slopes · constraints."""
        if not slopes.shape[1]:
            return np.zeros(())
        place = (slopes[:, 3:6] - slopes[:, :3]) / self.sizes
        along = slopes[:, 6:] * self.velocity / self.speed
        by_position = np.einsum("ic,icj->ij", place, self.jacobian) + np.einsum(
            "ic,icj->ij", along, self.bent
        )
        by_velocity = np.einsum("ic,icj->ij", along, self.jacobian)
        return np.array([by_position, by_velocity, np.zeros_like(by_position)])
