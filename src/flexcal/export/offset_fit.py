"""Joint offsets of the nominal robot with the smallest tool error, for controllers that accept nothing else."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.export.representation_error import (
    DrawPoses,
    PositionErrors,
    poses_of,
    random_poses,
    tool_positions,
)
from flexcal.model.kinematics import motor_motion, point_kinematics
from flexcal.model.parts import rotation_vector, vector_rotation
from flexcal.model.robot import RobotModel, propagated_covariance_root

_STEPS = 8
_SMALL = 1e-8
"""Step, m and rad, at which the iteration has converged."""
_SOME = 300
_UNSEEN = 1e-6
"""Size relative to the largest column below which an offset is equivalent to base and tool."""
_MADE_WITHIN = {"revolute": 5e-4, "prismatic": 3e-4}
"""Standard deviation, rad and m, of the zero of a joint without any calibration."""
_REST = 1e-4
"""Weight of base and tool relative to a tool error of their size: offsets are preferred where equivalent."""


@dataclass(frozen=True, eq=False)
class OffsetFit:
    """Fit of `offsets` (n,), rad or m, added to q of the nominal robot, with standard deviations `std` (n,), zero where unknown.

    `determined` (n,): False for those that the measured points do not tell, which are zero. `base` (6,): position, m, and
    rotation vector, rad, of the nominal robot's base in that of the real one; `tool` (3,) m is added to the target in its frame.
    `before` is the tool error of the nominal robot with the same freedom of base and tool and no offsets.
    """

    offsets: np.ndarray
    std: np.ndarray
    determined: np.ndarray
    base: np.ndarray
    tool: np.ndarray
    before: PositionErrors


def fit_offsets(
    model: RobotModel,
    nominal: RobotModel,
    point: str,
    *,
    keep_frames: bool,
    undetermined: Collection[int] = (),
    draw: DrawPoses | None = None,
) -> OffsetFit:
    """Least squares of the tool error between `model` at rest and `nominal` with offsets, base and tool, over random poses.

    The poses are those of `draw`, as `poses_of` takes it. With `keep_frames` base and tool stay. The standard deviations are
    those that the covariance of the model's parameters gives, to first order. Offsets of the joints `undetermined` are held at zero, and so
    are those that are known less well than a joint is made and do not differ from zero by two standard deviations.
    """
    fixed = np.isin(np.arange(model.n), sorted(undetermined))
    q, _ = poses_of(model, draw)(point, np.random.default_rng(1))
    fit = _fit(model, nominal, q, point, fixed, keep_frames=keep_frames)
    made = np.array([_MADE_WITHIN[joint.kind] for joint in model.motor_joints])
    weak = ~fixed & (fit.std > made) & (np.abs(fit.offsets) < 2 * fit.std)
    return _fit(model, nominal, q, point, fixed | weak, keep_frames=keep_frames) if weak.any() else fit


def undetermined_offsets(nominal: RobotModel, points: Sequence[str], *, base: bool) -> tuple[int, ...]:
    """Joints whose zero the measured `points` do not determine, because each point could sit elsewhere on the tool or, with `base`, the
    base elsewhere relative to the instrument.
    """
    rng = np.random.default_rng(2)
    free = np.ones(nominal.n + 9, dtype=bool)
    seen = np.zeros(nominal.n, dtype=bool)
    frames = np.arange(nominal.n + (0 if base else 6), nominal.n + 9)
    for point in points:
        q, _ = random_poses(nominal, point, rng)
        columns = _columns(nominal, q[:_SOME], np.zeros(nominal.n + 9), point, free)
        orthogonal = np.linalg.qr(columns[:, frames])[0]
        offsets = columns[:, : nominal.n]
        left = np.linalg.norm(offsets - orthogonal @ (orthogonal.T @ offsets), axis=0)
        seen |= left > _UNSEEN * np.linalg.norm(columns[:, : nominal.n], axis=0).max()
    return tuple(np.flatnonzero(~seen).tolist())


def _fit(
    model: RobotModel,
    nominal: RobotModel,
    q: np.ndarray,
    point: str,
    fixed: np.ndarray,
    *,
    keep_frames: bool,
) -> OffsetFit:
    """Fit at poses `q` (N, n) without the offsets `fixed` (n,) at zero."""
    targets, flank = tool_positions(model, q, point=point)
    n = model.n
    free = _free(n, frames=not keep_frames) & ~np.concatenate([fixed, np.zeros(9, dtype=bool)])
    fitted = _solve(nominal, q, targets, point, free)
    columns = _columns(nominal, q, fitted, point, free)
    spread = propagated_covariance_root(
        model, lambda m: tool_positions(m, q, point=point, flank=flank)[0].ravel()
    )
    rows = np.vstack([columns, _rest_rows(n, len(q))])
    response = least_squares(rows, np.vstack([spread, np.zeros((9, spread.shape[1]))]))
    std = np.linalg.norm(response, axis=1)
    before = nominal_error(nominal, q, targets, point, keep_frames=keep_frames)
    return OffsetFit(
        np.where(fixed, 0.0, fitted[:n]), std[:n], ~fixed, fitted[n : n + 6], fitted[n + 6 :], before
    )


def nominal_error(
    nominal: RobotModel, q: np.ndarray, targets: np.ndarray, point: str, *, keep_frames: bool = False
) -> PositionErrors:
    """Error of the nominal robot at `q` (N, n) against `targets` (N, 3), m, its base and tool fitted unless `keep_frames`."""
    free = (np.arange(nominal.n + 9) >= nominal.n) & (not keep_frames)
    frames = _solve(nominal, q, targets, point, free)
    return PositionErrors.of(targets - offset_tool(nominal, q, frames, point))


def offset_tool(nominal: RobotModel, q: np.ndarray, parameters: np.ndarray, point: str) -> np.ndarray:
    """Target (N, 3), m, of the nominal robot with `parameters` (n + 9,): offsets, base, tool as in `OffsetFit`."""
    n = nominal.n
    moved = parameters[n : n + 6]
    at = point_kinematics(nominal, q + parameters[:n], point=point, jacobians=False)
    position = at.position + at.orientation @ parameters[n + 6 :]
    return position @ vector_rotation(moved[3:]).T + moved[:3]


def _free(n: int, *, frames: bool) -> np.ndarray:
    """Mask (n + 9,) of the fitted parameters of `offset_tool`: all, or the offsets alone without `frames`."""
    return (np.arange(n + 9) < n) | frames


def _solve(
    nominal: RobotModel, q: np.ndarray, targets: np.ndarray, point: str, free: np.ndarray
) -> np.ndarray:
    """Gauss-Newton from zero over the `free` parameters, (n + 9,)."""
    parameters = np.zeros(nominal.n + 9)
    rest = _rest_rows(nominal.n, len(q))
    for _ in range(_STEPS):
        columns = _columns(nominal, q, parameters, point, free)
        missing = (targets - offset_tool(nominal, q, parameters, point)).ravel()
        rows, right = np.vstack([columns, rest]), np.concatenate([missing, -rest @ parameters])
        step = least_squares(rows, right)
        turned = vector_rotation(step[nominal.n + 3 : nominal.n + 6]) @ vector_rotation(
            parameters[nominal.n + 3 : nominal.n + 6]
        )
        parameters = parameters + step
        parameters[nominal.n + 3 : nominal.n + 6] = rotation_vector(turned)
        if np.abs(step).max() < _SMALL:
            break
    return parameters


def _columns(
    nominal: RobotModel, q: np.ndarray, parameters: np.ndarray, point: str, free: np.ndarray
) -> np.ndarray:
    """Derivative (3 N, n + 9) of `offset_tool` by its parameters, zero for those that are not `free`."""
    n = nominal.n
    at = point_kinematics(nominal, q + parameters[:n], point=point)
    turn = vector_rotation(parameters[n + 3 : n + 6])
    columns = np.zeros((len(q), 3, n + 9))
    by_offset = at.geometry_jacobian[:, :, : 6 * len(nominal.joints) : 6] @ motor_motion(nominal)
    lever = (at.orientation @ parameters[n + 6 :])[:, :, None]
    columns[:, :, :n] = turn @ (by_offset[:, :3] + np.cross(by_offset[:, 3:], lever, axis=1))
    where = offset_tool(nominal, q, parameters, point) - parameters[n : n + 3]
    columns[:, :, n : n + 3] = np.eye(3)
    columns[:, :, n + 3 : n + 6] = -np.cross(where[:, :, None], np.eye(3)[None], axis=1)
    columns[:, :, n + 6 :] = turn @ at.orientation
    return (columns * free).reshape(-1, n + 9)


def least_squares(rows: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Minimum-norm solution, by QR of tall rows."""
    orthogonal, triangle = np.linalg.qr(rows)
    return np.linalg.lstsq(triangle, orthogonal.T @ right, rcond=None)[0]


def _rest_rows(n: int, poses: int) -> np.ndarray:
    return _REST * np.sqrt(3 * poses) * np.eye(n + 9)[n:]
