"""Measured poses of the virtual robot at rest: true values, encoder readings and tracker readings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.plans import PosePlan
from flexcal.data.poses import PoseSet
from flexcal.model.parts import vector_rotation
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell.config import CellConfig
from flexcal.virtual_cell.equilibrium import rest
from flexcal.virtual_cell.plant import build_plant
from flexcal.virtual_cell.sensors import read_encoder, read_torque, tracker_sigma
from flexcal.virtual_cell.warming import COLD, INTERVAL, changes_with_temperature, temperature_share


@dataclass(frozen=True, eq=False)
class TruePoses:
    """`q` (N, n) motor side; `payload` (N,) kg or None; `point` (N, 3) m in the base frame; `torque` (N, n) N m against gravity."""

    q: np.ndarray
    payload: np.ndarray | None
    point: np.ndarray
    torque: np.ndarray


def true_poses(
    truth: RobotModel, config: CellConfig, plan: PosePlan, rng: np.random.Generator | None = None
) -> TruePoses:
    """The first declared point at every pose of a plan.

    A hysteretic drive lags behind its motor by all of its half width where the plan says from which side the joint comes; else `rng`
    draws its state (none without it).
    """
    import mujoco

    q, payload = plan.q, plan.payload
    slips = np.zeros(q.shape) if rng is None else rng.uniform(-1, 1, q.shape)
    if plan.approach is not None:
        slips = np.where(plan.approach == 0, slips, plan.approach)
    name = truth.point().name
    point, torque = np.empty((len(q), 3)), np.empty(q.shape)
    masses = np.zeros(len(q)) if payload is None else payload
    for mass in np.unique(masses):
        plant = build_plant(truth, config, payload=None if payload is None else float(mass))
        data = mujoco.MjData(plant.mjmodel)
        driven = plant.twists >= 0
        slip = np.zeros(plant.mjmodel.nv)
        for k in np.flatnonzero(masses == mass):
            slip[plant.twists[driven]] = slips[k, driven]
            torque[k] = rest(plant, data, q[k], slip).torque
            point[k] = data.site(name).xpos
    return TruePoses(q, payload, point, torque)


def in_instrument(truth: RobotModel, point: np.ndarray) -> np.ndarray:
    """Points (N, 3) or (3,), m, from the robot's base frame into the first station's."""
    station = truth.stations.pose[0]
    return station[:3] + point @ vector_rotation(station[3:]).T


def measured_poses(
    truth: RobotModel, config: CellConfig, plan: PosePlan, rng: np.random.Generator
) -> PoseSet:
    """Measured poses of a plan from encoders, torque sensors and the tracker at the first station."""
    sensors, mismatch = config.sensors, config.mismatch
    share = temperature_share(mismatch, len(plan.q))
    rise = mismatch.temperature_rise * share
    drift = np.zeros(truth.n)
    if mismatch.zero_drift > 0:
        drift = mismatch.zero_drift * rng.standard_normal(truth.n)
    true = true_poses(truth, config, replace(plan, q=plan.q + np.outer(rise, drift)), rng)
    size = len(true.q)
    band = config.friction.scale * np.nan_to_num(truth.drives.coulomb) * (1 + config.friction.stribeck)
    torque = read_torque(sensors, true.torque + band * rng.uniform(-1, 1, true.torque.shape), rng)
    grown = true.point * (1 + mismatch.link_growth * rise)[:, None]
    point = grown + mismatch.repeatability * rng.standard_normal(true.point.shape)
    temperature, time = None, None
    if changes_with_temperature(mismatch):
        temperature, time = COLD + rise, INTERVAL * np.arange(size)
    if temperature is not None and mismatch.temperature_noise > 0:
        temperature = temperature + mismatch.temperature_noise * rng.standard_normal(size)
    if mismatch.temperature_drift > 0:
        direction = rng.standard_normal(3)
        point = point + share[:, None] * mismatch.temperature_drift * direction / np.linalg.norm(direction)
    station = truth.config.stations.get(truth.stations.names[0])
    seen = in_instrument(truth, point)
    place = None if station is None else station.in_base
    stand = in_instrument(truth, np.zeros(3) if place is None else np.array(place))
    noise = tracker_sigma(sensors, np.linalg.norm(seen - stand, axis=1))
    position = seen + noise[:, None] * rng.standard_normal(point.shape)
    # what the tracker says of its noise is by the distance that it measured
    sigma = tracker_sigma(sensors, np.linalg.norm(position - stand, axis=1))
    return PoseSet(
        q=read_encoder(sensors, plan.q),
        position=position,
        sigma=np.repeat(sigma[:, None], 3, axis=1),
        torque=torque,
        payload=true.payload,
        target=np.full(size, truth.point().name),
        station=np.full(size, truth.stations.names[0]),
        temperature=temperature,
        time=time,
        pose=plan.numbers,
        approach=None if plan.approach is None else plan.approach.astype(float),
    )
