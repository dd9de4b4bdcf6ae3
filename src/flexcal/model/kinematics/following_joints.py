"""Motion of all joints of a robot, those that follow others by relations and loops included, with exact derivatives.

Joints that follow turn by what their relation makes of the actual positions of others: C e, e being what every joint deviates by from its
own motor or relation. What loops determine closes them: ψ(p, e, g) = 0 by Newton's method, and dp = -(∂ψ/∂p)⁻¹ (∂ψ/∂e de + ∂ψ/∂g dg) by
the implicit function theorem.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.model.parts import Loop, LoopEnd, Relations, kinematic_tree
from flexcal.model.robot import ORIGIN, RobotModel

_ITERATIONS = 30
_CLOSED = 1e-11
"""Gap, m, at which a loop counts as closed."""
_NEARLY = 1e-4
"""The same on the way to a pose."""
_REMEMBERED = 32
_STEP = 0.2
"""Longest motion of a motor, rad or m, between two closures on the way to a pose."""
_LONGEST = 0.3
"""Longest step of a passive joint, rad or m, in one iteration."""
_SINGULAR = 1e12
_LEAST_SQUARES = 200


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Positions of N joints, of them the nominal `q` (samples, N), and `deflection` (samples, N, 3): tilts and what joints turn beyond q.

    Derivatives of what a joint turns beyond its own deviation: `by_motion` (samples, N, 3 N) by tilts and own deviation of every joint,
    and `by_geometry` (samples, N, G) by the errors of `RobotModel.geometry_columns`. NaN where a loop does not close.
    """

    q: np.ndarray
    deflection: np.ndarray
    by_motion: np.ndarray
    by_geometry: np.ndarray


def joint_positions(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Nominal positions (samples, N) of all joints at the motors' `q` (samples, n); NaN where a loop does not close."""
    relations = model.relations
    if relations is None:
        return q
    linear = relations.linear(q)
    if not relations.loops:
        return linear
    key = q.tobytes()
    if key not in relations.closed:
        while len(relations.closed) >= _REMEMBERED:
            relations.closed.pop(next(iter(relations.closed)))
        relations.closed[key] = _closed_positions(model, relations, q)
    return relations.closed[key]


def _closed_positions(model: RobotModel, relations: Relations, q: np.ndarray) -> np.ndarray:
    """`joint_positions` of a robot with loops, along the straight way from where the motors are at rest."""
    linear = relations.linear(q)
    nominal = _Closure(model, relations, geometry=False)
    at_rest = np.array([min(max(0.0, joint.lower), joint.upper) for joint in model.motor_joints])
    away = np.where(np.isin(relations.motors, relations.closing), q - at_rest, 0.0)
    start = q - away
    steps = max(1, int(np.ceil(np.abs(away).max(initial=0.0) / _STEP)))
    still = np.zeros((*linear.shape, 3))
    passive = np.tile(np.concatenate([loop.start for loop in relations.loops]), (len(q), 1))
    for k in range(steps + 1):
        passive = nominal.close(
            relations.linear(start + k / steps * away), still, passive, _NEARLY if k < steps else _CLOSED
        )
    return linear + passive @ nominal.carry.T


def joint_motion(
    model: RobotModel, q: np.ndarray, deflection: np.ndarray, *, derivatives: bool
) -> JointMotion:
    """Motion of all joints at the motors' `q` (samples, n), deviating by `deflection` (samples, N, 3): tilts and twist beyond motor or
    relation.

    For a robot with relations. Without `derivatives` these are empty.
    """
    relations = model.relations
    assert relations is not None
    joints, samples = len(model.joints), len(q)
    others = relations.carry - np.eye(joints)
    positions = joint_positions(model, q)
    moved = deflection.copy()
    moved[:, :, 2] += (deflection[:, :, 2] + model.geometry.errors[:, 0]) @ others.T
    kept = samples if derivatives else 0
    by_motion = np.zeros((kept, joints, joints, 3))
    by_geometry = np.zeros((kept, joints, len(model.geometry_columns)))
    by_motion[:, :, :, 2] = by_geometry[:, :, : 6 * joints : 6] = others
    by_motion = by_motion.reshape(kept, joints, 3 * joints)
    if relations.loops:
        closure = _Closure(model, relations, geometry=True)
        passive = closure.close(positions, moved, np.zeros((samples, len(relations.passive))))
        moved[:, :, 2] += passive @ closure.carry.T
        if derivatives:
            _, jacobian, own_motion, own_geometry = closure.gap(positions, moved)
            through = own_motion[:, :, 2::3]
            right = np.concatenate(
                [own_motion + through @ by_motion, own_geometry + through @ by_geometry], axis=2
            )
            open_ = ~np.isfinite(passive).all(axis=1)
            jacobian[open_], right[open_] = np.eye(jacobian.shape[1]), np.nan
            following = closure.carry @ -np.linalg.solve(jacobian, right)
            by_motion = by_motion + following[:, :, : 3 * joints]
            by_geometry = by_geometry + following[:, :, 3 * joints :]
    return JointMotion(positions, moved, by_motion, by_geometry)


def loop_gap(model: RobotModel, q: np.ndarray) -> tuple[str, float]:
    """Loop of the nominal robot that stays open at the motors' `q` (n,), and the least gap, m, to which its passive joints bring it."""
    relations = model.relations
    assert relations is not None
    nominal = _Closure(model, relations, geometry=False)
    positions, moved = relations.linear(q[None]), np.zeros((1, len(model.joints), 3))
    passive = np.concatenate([loop.start for loop in relations.loops])
    damping, best = 1.0, np.inf
    gap, jacobian, kept = np.zeros(0), np.zeros((0, 0)), passive
    for _ in range(_LEAST_SQUARES):
        moved[0, :, 2] = nominal.carry @ passive
        tried, by_passive, _, _ = nominal.gap(positions, moved)
        if np.linalg.norm(tried[0]) < best:
            best, gap, jacobian, kept, damping = (
                np.linalg.norm(tried[0]),
                tried[0],
                by_passive[0],
                passive,
                damping / 4,
            )
        else:
            damping *= 8
        square = jacobian.T @ jacobian
        passive = kept - np.linalg.solve(
            square + damping * np.trace(square) * np.eye(len(square)), jacobian.T @ gap
        )
    ends = np.cumsum([len(loop.rows) for loop in relations.loops])[:-1]
    sizes = [float(np.linalg.norm(part)) for part in np.split(gap, ends)]
    return relations.loops[int(np.argmax(sizes))].name, max(sizes)


class _Closure:
    """Equations ψ (samples, k) of all loops: the gap between their ends, m, along the directions in which they meet."""

    def __init__(self, model: RobotModel, relations: Relations, *, geometry: bool) -> None:
        self.model, self.loops = model, relations.loops
        self.carry = relations.carry[:, list(relations.passive)]
        own = model.geometry
        self.tree = model.tree if geometry else kinematic_tree(model.joints, {})
        self.errors = own.errors if geometry else np.zeros_like(own.errors)
        self.own = own.loops if geometry else np.zeros_like(own.loops)

    def close(
        self, q: np.ndarray, deflection: np.ndarray, start: np.ndarray, tolerance: float = _CLOSED
    ) -> np.ndarray:
        """Passive positions (samples, k) beyond `q` (samples, N) and `deflection` that close the loops, from `start`; NaN where none do."""
        passive, moved = start.copy(), deflection.copy()
        active = np.asarray(np.isfinite(np.hstack([q, start])).all(axis=1))
        passive[~active] = np.nan
        for _ in range(_ITERATIONS):
            rows = np.flatnonzero(active)
            if not len(rows):
                return passive
            moved[rows, :, 2] = deflection[rows, :, 2] + passive[rows] @ self.carry.T
            gap, jacobian, _, _ = self.gap(q[rows], moved[rows])
            jacobian[np.linalg.cond(jacobian) > _SINGULAR] += 1e-6 * np.eye(jacobian.shape[1])
            step = -np.linalg.solve(jacobian, gap[:, :, None])[:, :, 0]
            step *= np.minimum(1.0, _LONGEST / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
            passive[rows] += step
            active[rows] = np.abs(gap).max(axis=1) > tolerance
        passive[active] = np.nan
        return passive

    def gap(
        self, q: np.ndarray, deflection: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """ψ (samples, k) and its derivatives by passive positions (samples, k, k), motions (samples, k, 3 N) and geometry (…, G)."""
        parts = [self._gap_of(i, loop, q, deflection) for i, loop in enumerate(self.loops)]
        gap, by_motion, by_geometry = (np.concatenate(part, axis=1) for part in zip(*parts, strict=True))
        return gap, by_motion[:, :, 2::3] @ self.carry, by_motion, by_geometry

    def _gap_of(
        self, index: int, loop: Loop, q: np.ndarray, deflection: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        model, columns = self.model, self.model.geometry_columns
        at_a, turn_a, motion_a, geometry_a = self._end(loop.a, self.own[index, :3], q, deflection)
        at_b, turn_b, motion_b, geometry_b = self._end(loop.b, self.own[index, 3:], q, deflection)
        _, turn, motion, geometry = self._end(_link(loop.ground), np.zeros(3), q, deflection)
        back = np.matmul(loop.rows, np.swapaxes(turn, 1, 2))
        apart = at_a - at_b
        gap = np.matmul(back, apart[:, :, None])[:, :, 0]
        # d(Rᵀ v) = Rᵀ (dv + v × ω) for a frame R that turns by ω
        turned, moved = (np.cross(apart[:, :, None], own[:, 3:], axis=1) for own in (motion, geometry))
        by_motion = back @ (motion_a[:, :3] - motion_b[:, :3] + turned)
        by_geometry = np.zeros((len(q), len(loop.rows), len(columns)))
        by_joints = back @ (geometry_a[:, :3] - geometry_b[:, :3] + moved)
        by_geometry[:, :, : by_joints.shape[2]] = by_joints
        for key in loop.errors:
            axis = "xyz".index(key[-1])
            own = turn_a[:, :, axis] if key[0] == "a" else -turn_b[:, :, axis]
            by_geometry[:, :, columns[f"loop.{loop.name}.{key}"]] = np.matmul(back, own[:, :, None])[:, :, 0]
        for joint in set(model.branching) & set(loop.around):
            _, axes, _, _ = self._end(_link(model.joints[joint].parent), np.zeros(3), q, deflection)
            sign = 1.0 if joint in model.path_to(loop.a.joint) else -1.0
            first = columns[f"{model.joints[joint].name}.{ORIGIN[0]}"]
            by_geometry[:, :, first : first + 3] = sign * (back @ axes)
        return gap, by_motion, by_geometry

    def _end(
        self, end: LoopEnd, shift: np.ndarray, q: np.ndarray, deflection: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Position (samples, 3), rotation (samples, 3, 3) and Jacobians (samples, 6, 3 N) and (samples, 6, 6 N) of an end."""
        joints, samples = len(self.model.joints), len(q)
        if end.joint < 0:
            at = np.broadcast_to(end.translation + end.rotation @ shift, (samples, 3))
            still = np.zeros((samples, 6, 6 * joints))
            return at, np.broadcast_to(end.rotation, (samples, 3, 3)), still[:, :, : 3 * joints], still
        at, turn, geometry, motion = self.tree.point(
            end.joint, end.rotation, end.translation, shift, self.errors, np.zeros(6), q, deflection, True
        )
        return at, turn, motion, geometry[:, :, : 6 * joints]


def _link(joint: int) -> LoopEnd:
    """Frame of a joint's link, or of the base for -1."""
    return LoopEnd(joint, np.eye(3), np.zeros(3))
