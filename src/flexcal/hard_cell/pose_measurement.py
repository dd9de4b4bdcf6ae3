"""Measured poses of the hard cell: true values, encoder, torque and laser tracker readings."""

from __future__ import annotations

import numpy as np

from flexcal.data.plans import PosePlan
from flexcal.data.poses import PoseSet
from flexcal.hard_cell.description import ArmDescription
from flexcal.hard_cell.equilibrium import stand
from flexcal.hard_cell.multibody import Multibody, build
from flexcal.hard_cell.recordings import TORQUE_NOISE, counted
from flexcal.hard_cell.true_parameters import HardRobot

RADIAL, TRANSVERSE, PER_METRE = 5e-6, 12e-6, 6e-6  # m, m, and m per m of distance: 1σ of the tracker
STATED = 15e-6  # m: of a coordinate, and PER_METRE, as its data sheet would say
WARM_AFTER = 0.3  # share of a measurement in which the arm warms to within 1/e


def true_points(robot: HardRobot, described: ArmDescription, plan: PosePlan) -> np.ndarray:
    """The reflector (N, 3), m, in the tracker's frame, warming up as in a measurement but without scatter, friction and noise."""
    return _in_tracker(robot, _standing(robot, described, plan, None)[0])


def measured_points(robot: HardRobot, described: ArmDescription, plan: PosePlan, seed: int) -> PoseSet:
    """Measurements of all instruments in every pose of a plan."""
    rng = np.random.default_rng([seed, 2, plan.seed, len(plan)])
    size = len(plan)
    point, gravity = _standing(robot, described, plan, rng)
    point = point + robot.point_scatter * rng.standard_normal((size, 3))
    stuck = robot.arm.coulomb + robot.stribeck + robot.per_load * np.abs(gravity)
    torque = (gravity + stuck * rng.uniform(-1, 1, gravity.shape)) / robot.torque_gain
    seen = _in_tracker(robot, point)
    distance = np.linalg.norm(seen, axis=1, keepdims=True)
    sight = seen / distance
    noise = rng.standard_normal((size, 3))
    along = (noise * sight).sum(axis=1, keepdims=True) * sight
    seen = seen + RADIAL * along + (TRANSVERSE + PER_METRE * distance) * (noise - along)
    stated = robot.sigma_factor * (STATED + PER_METRE * np.linalg.norm(seen, axis=1))
    return PoseSet(
        q=counted(plan.q),
        position=seen,
        sigma=np.repeat(stated[:, None], 3, axis=1),
        torque=torque + TORQUE_NOISE * rng.standard_normal(torque.shape),
        payload=plan.payload,
        target=np.full(size, described.point[0]),
        station=np.full(size, described.station[0]),
        temperature=None,
        pose=plan.numbers,
    )


def _standing(
    robot: HardRobot, described: ArmDescription, plan: PosePlan, rng: np.random.Generator | None
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) m in the base frame and torques (N, n) N m against gravity; `rng` of slip and scatter."""
    masses = np.full(len(plan), described.payload) if plan.payload is None else plan.payload
    arms = {m: build(robot, payload=robot.carried(float(m))) for m in np.unique(masses)}
    places = {m: arm.mjmodel.body_pos.copy() for m, arm in arms.items()}
    warmth = 1 - np.exp(-np.arange(len(plan)) / max(WARM_AFTER * len(plan), 1.0))
    point, torque = np.empty((len(plan), 3)), np.empty(plan.q.shape)
    for k, q in enumerate(plan.q):
        arm = arms[masses[k]]
        _expand(arm, robot, places[masses[k]], float(warmth[k]))
        slip = None if rng is None else rng.uniform(-1, 1, robot.n)
        scatter = None if rng is None else robot.joint_scatter * rng.standard_normal(robot.n)
        equilibrium = stand(robot, arm, q, slip=slip, scatter=scatter)
        point[k], torque[k] = equilibrium.point, equilibrium.torque
    return point, torque


def _expand(arm: Multibody, robot: HardRobot, places: np.ndarray, warmth: float) -> None:
    """Lengthen every link by its share of the warming."""
    longer = {link.name: 1 + warmth * e for link, e in zip(robot.arm.links, robot.expansion, strict=True)}
    for b in range(1, arm.mjmodel.nbody):
        arm.mjmodel.body_pos[b] = places[b] * longer[arm.mjmodel.body(b).name]


def _in_tracker(robot: HardRobot, point: np.ndarray) -> np.ndarray:
    rotation, place = robot.station
    return (point - place) @ rotation
