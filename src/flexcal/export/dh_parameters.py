"""Denavit-Hartenberg parameters of the chain of joints that moves a target, from the positions of its axes.

Axis k carries a frame with z along it. Turned by theta and shifted by d along z, its x points to the next axis, whose frame follows:

    T = Rz(theta + q) Tz(d) Tx(a) Rx(alpha) Ry(beta)

With beta = 0 this is the standard convention (Denavit, Hartenberg 1955); read from Tx(a) on, one row later, it is the modified
one (Craig 1986; Khalil, Kleinfinger 1986). Consecutive axes that are nearly parallel have their common normal far away, or nowhere: there
d keeps its nominal value and beta, the turn about y, takes its place (Hayati, Mirmirani 1985).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.export.transforms import X, Y, Z, shifted, transform, turned
from flexcal.model.kinematics import joint_placement, link_placement, point_placement
from flexcal.model.parts import normals_to
from flexcal.model.robot import RobotModel

NEARLY_PARALLEL = np.deg2rad(1.0)
_COINCIDENT = 1e-3
"""Distance, m, of nominally parallel axes below which their common normal is undefined."""


@dataclass(frozen=True, eq=False)
class Axes:
    """Axes of a target's chain with its joints at zero: indices of the `joints` (m,), a point (m, 3) and the direction (m, 3) of every
    axis.

    `tool` (4, 4) is the target's frame; all in the robot's base frame.
    """

    joints: tuple[int, ...]
    points: np.ndarray
    directions: np.ndarray
    tool: np.ndarray


@dataclass(frozen=True, eq=False)
class DhChain:
    """Denavit-Hartenberg chain `base` (4, 4) · Π Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta) · `tool` (4, 4); arrays (m,) in rad and m.

    Position q of a revolute joint adds to its theta, of a prismatic one to its d. `x` (m, 3): where the common normals point with the
    joints at zero. The last joint has a = alpha = beta = 0, and d to the foot of the tool, or as the chain that this one is made like:
    where the tool is along the last axis, and about it, is the tool's.
    """

    base: np.ndarray
    theta: np.ndarray
    d: np.ndarray
    a: np.ndarray
    alpha: np.ndarray
    beta: np.ndarray
    tool: np.ndarray
    x: np.ndarray


def chain_axes(model: RobotModel, point: str, chain: tuple[int, ...]) -> Axes:
    """The axes of the joints `chain` between base and a target, geometric errors included."""
    _, position, rotation = point_placement(model, point)
    at = np.eye(4)
    points, directions = [], []
    for i in chain:
        axis = at @ transform(*joint_placement(model, i))
        points.append(axis[:3, 3])
        directions.append(axis[:3, :3] @ model.joints[i].axis)
        at = at @ transform(*link_placement(model, i))
    return Axes(chain, np.array(points), np.array(directions), at @ transform(position, rotation))


def dh_chain(axes: Axes, *, hayati: bool, like: DhChain | None = None) -> DhChain:
    """Parameters of a chain; where they are not unique, those of the chain `like` (default: the smallest angles).

    Consecutive axes within 1° of parallel (in `like`, where given) keep d, for their common normal is far away or nowhere; with `hayati`
    they get beta, without, the tilt about y is left out. Where they coincide in `like`, theta stays too, and what they are apart
    across x is left out.
    """
    count = len(axes.joints)
    theta, d, a, alpha, beta = np.zeros((5, count))
    normals = np.zeros((count, 3))
    base = frame = _first_frame(axes.points[0], axes.directions[0])
    for k in range(count - 1):
        z, following = frame[:3, 2], axes.directions[k + 1]
        angle = _angle_between(z, following) if like is None else nominal_angle(like, k)
        parallel = angle < NEARLY_PARALLEL
        preferred = frame[:3, 0] if like is None else like.x[k]
        if parallel:
            d[k] = 0.0 if like is None else like.d[k]
            start = frame[:3, 3] + d[k] * z
            along = ((start - axes.points[k + 1]) @ z) / (following @ z)
            across = axes.points[k + 1] + along * following - start
        else:
            across = np.cross(z, following)
            d[k] = _foot(frame[:3, 3], z, axes.points[k + 1], following)
            start = frame[:3, 3] + d[k] * z
        together = parallel and like is not None and abs(like.a[k]) < _COINCIDENT
        x = _unit(np.zeros(3) if together else across, z, preferred)
        theta[k] = np.arctan2(x @ frame[:3, 1], x @ frame[:3, 0])
        a[k] = across @ x if parallel else (axes.points[k + 1] - start) @ x
        beta[k] = np.arcsin(following @ x) if hayati and parallel else 0.0
        alpha[k] = np.arctan2(-(following @ np.cross(z, x)), following @ z)
        normals[k] = x
        frame = frame @ joint_transform(theta[k], d[k]) @ link_transform(a[k], alpha[k], beta[k])
    d[-1] = (axes.tool[:3, 3] - frame[:3, 3]) @ frame[:3, 2] if like is None else like.d[-1]
    normals[-1] = frame[:3, 0]
    frame = frame @ joint_transform(0.0, d[-1])
    return DhChain(base, theta, d, a, alpha, beta, np.linalg.solve(frame, axes.tool), normals)


def slides_moved(axes: Axes, nominal: Axes, kinds: Sequence[str]) -> Axes:
    """Chain with the axes of prismatic joints, whose position is free, moved to their `nominal` place relative to the following ones.

    So theta of a slide that is parallel to the next axis does not turn with hundredths of a millimetre.
    """
    points = axes.points.copy()
    after, before = axes.tool[:3, 3], nominal.tool[:3, 3]
    for k in reversed(range(len(points))):
        if kinds[k] == "prismatic":
            points[k] = nominal.points[k] + after - before
        after, before = points[k], nominal.points[k]
    return replace(axes, points=points)


def joint_transform(theta: float, d: float) -> np.ndarray:
    """Rz(theta) Tz(d), (4, 4)."""
    return turned(Z, theta) @ shifted(Z, d)


def link_transform(a: float, alpha: float, beta: float) -> np.ndarray:
    """Tx(a) Rx(alpha) Ry(beta), (4, 4)."""
    return shifted(X, a) @ turned(X, alpha) @ turned(Y, beta)


def _first_frame(point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Frame of the first axis: at its point nearest the base, x nearest to an axis of the base; the base itself on z."""
    normals = normals_to(direction)
    x = normals[0]
    return transform(
        point - (point @ direction) * direction, np.column_stack([x, np.cross(direction, x), direction])
    )


def nominal_angle(chain: DhChain, k: int) -> float:
    """Angle between the axes k and k + 1 of a chain, 0 to π/2 rad."""
    z = link_transform(0.0, chain.alpha[k], chain.beta[k])[:3, 2]
    return _angle_between(Z, z)


def _angle_between(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two lines' directions, 0 to π/2."""
    return float(np.arctan2(np.linalg.norm(np.cross(one, other)), abs(one @ other)))


def _foot(origin: np.ndarray, z: np.ndarray, point: np.ndarray, direction: np.ndarray) -> float:
    """Coordinate d of the foot of the common normal on the line `origin` + d z."""
    cosine = z @ direction
    between = point - origin
    return float((between @ z - cosine * (between @ direction)) / (1 - cosine * cosine))


def _unit(across: np.ndarray, z: np.ndarray, preferred: np.ndarray) -> np.ndarray:
    """Direction of `across` normal to z, or its opposite, nearer to `preferred`; that itself if undefined."""
    normal = across - (across @ z) * z
    length = np.linalg.norm(normal)
    if length < 1e-12:
        normal = preferred - (preferred @ z) * z
        length = np.linalg.norm(normal)
    unit = normal / length
    side = unit @ preferred
    return -unit if side < -1e-9 else unit
