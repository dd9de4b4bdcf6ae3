"""Growth of links and drift of joint zeros with the temperature of the arm."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from flexcal.model.kinematics.forward import PointKinematics
from flexcal.model.kinematics.link_poses import link_frames
from flexcal.model.robot import RobotModel


def temperature_rise(model: RobotModel, temperature: np.ndarray) -> np.ndarray:
    """Temperatures (N,) above that at which the robot's parameters hold, K."""
    return temperature - model.thermal.reference[0]


def depends_on_temperature(model: RobotModel) -> bool:
    """Whether the robot, or where its instruments stand, changes with temperature."""
    thermal = model.thermal
    moving = (thermal.expansion, thermal.link_expansion, thermal.zero_drift, model.stations.drift)
    return any(bool(values.any()) for values in moving)


def link_vectors(model: RobotModel, q: np.ndarray, position: np.ndarray, end: int) -> np.ndarray:
    """Vectors (N, joints, 3), m, of every link from its joint to the next one on the way to a point, in the base frame.

    The point is at `position` (N, 3) on the link `end`; zero for links that do not carry it.
    Motion of slides counts as length of the link before them. Deflection turns links by some 1e-3, which is left out.
    """
    _, origin = link_frames(model, q)
    vectors = np.zeros((len(position), len(model.joints), 3))
    path = model.path_to(end)
    for i, after in pairwise(path):
        vectors[:, i] = origin[:, after] - origin[:, i]
    if path:
        vectors[:, path[-1]] = position - origin[:, path[-1]]
    return vectors


def expanded(
    model: RobotModel, q: np.ndarray, at: PointKinematics, ends: np.ndarray, rise: np.ndarray
) -> PointKinematics:
    """Points `at` their places at the reference temperature, of links `ends` (N,), where the arm is warmer by `rise` (N,), K.

    All lengths from the base on grow by 1 + α ΔT, so that the position does; no angle changes. What single links grow beyond that
    adds to it along the `link_vectors`, and to first order moves the derivatives by nothing.
    """
    factor = 1 + model.thermal.expansion[0] * rise
    position = at.position * factor[:, None]
    if model.thermal.link_expansion.any():
        for end in np.unique(ends).tolist():
            own = ends == end
            vectors = link_vectors(model, q[own], at.position[own], end)
            grown = np.einsum("i,nik->nk", model.thermal.link_expansion, vectors)
            position[own] += rise[own, None] * grown
    geometry, motion = at.geometry_jacobian, at.motion_jacobian
    if len(geometry):
        geometry, motion = geometry.copy(), motion.copy()
        geometry[:, :3] *= factor[:, None, None]
        motion[:, :3] *= factor[:, None, None, None]
    return replace(at, position=position, geometry_jacobian=geometry, motion_jacobian=motion)
