"""A frequency experiment on the virtual robot: every recording of a multisine plan, some at a time on as many threads."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.data.recordings import Recording, RecordingLabel
from flexcal.errors import FlexcalError
from flexcal.frequency.periodic import excitation_torque, reference_trajectory, samples_per_period
from flexcal.model.robot import ArmSensor, RobotModel
from flexcal.virtual_cell.arm_sensor_readings import arm_readings, mounted, reading_noise, sensitivities
from flexcal.virtual_cell.closed_loop import LoopCommand, LoopGains, run_loop
from flexcal.virtual_cell.config import CellConfig
from flexcal.virtual_cell.equilibrium import rest
from flexcal.virtual_cell.feed_forward import inverse_dynamics
from flexcal.virtual_cell.plant import Plant, build_plant
from flexcal.virtual_cell.sensors import encoder_resolution, read_encoder, read_torque
from flexcal.virtual_cell.step_size import resolved_plant


@dataclass(frozen=True, eq=False)
class Excitation:
    """Common data of all recordings of one pose: the pose (n,), plant, loop, start (d,), the command without excitation, and the sensors
    on the arm of the `truth` as mounted.
    """

    pose: np.ndarray
    plant: Plant
    gains: LoopGains
    start: np.ndarray
    start_rate: np.ndarray
    command: LoopCommand
    truth: RobotModel
    sensors: tuple[ArmSensor, ...]


def recordings(
    truth: RobotModel, believed: RobotModel, config: CellConfig, plan: MultisinePlan, seed: int, threads: int
) -> Iterator[Recording]:
    """The recordings of a plan in the order pose, realisation, experiment, sign; each a function of `seed` and its label alone."""
    if plan.torque == "instantaneous":
        raise FlexcalError(
            "E-CELL-024",
            "the virtual cell's torque is held over a sample, not instantaneous; write `tau: held` in the plan.",
        )
    signs = (1, -1) if plan.signs else (1,)
    schedule = list(product(range(plan.realisations), range(len(plan.joints)), signs))
    with ThreadPoolExecutor(threads) as pool:
        waiting: deque[Future[Recording]] = deque()
        try:
            for number, pose in enumerate(plan.poses):
                excitation = prepare(truth, believed, config, plan, pose, seed)
                for realisation, experiment, sign in schedule:
                    label = RecordingLabel(number, realisation, experiment, sign)
                    waiting.append(pool.submit(run, excitation, config, plan, label, seed))
                    while len(waiting) > threads:
                        yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)


def prepare(
    truth: RobotModel,
    believed: RobotModel,
    config: CellConfig,
    plan: MultisinePlan,
    pose: np.ndarray,
    seed: int = 0,
) -> Excitation:
    """Build the plant at a pose (n,) and the feed-forward of the controller, whose own model is `believed`."""
    import mujoco

    free = sorted(plan.joints)
    sensors = mounted(truth, seed)
    plant, substeps = resolved_plant(
        truth, config, q=pose, free=free, payload=plan.payload, rate_hz=plan.rate_hz, sensors=sensors
    )
    assumed = build_plant(believed, config, q=pose, free=free, payload=plan.payload)
    samples = plan.periods * samples_per_period(plan.base_frequency_hz, 1 / plan.rate_hz)
    reference = reference_trajectory(plan, np.arange(samples) / plan.rate_hz)
    motion, rate, acceleration = (np.repeat(x[:, None], len(free), axis=1) for x in reference)
    expected = np.zeros(assumed.mjmodel.nv)
    expected[assumed.motors] = pose[free]
    torque = inverse_dynamics(assumed, expected, motion, rate, acceleration)
    start = rest(plant, mujoco.MjData(plant.mjmodel), pose[free] + motion[0]).position
    start_rate = np.zeros_like(start)
    start_rate[plant.motors] = rate[0]
    kp, kd = plan.kp[free], plan.kd[free]
    gains = LoopGains(kp, kd, plan.rate_hz, substeps, config.controller.rate_filter_hz)
    command = LoopCommand(torque, pose[free] + motion, rate)
    return Excitation(pose, plant, gains, start, start_rate, command, truth, sensors)


def run(
    excitation: Excitation, config: CellConfig, plan: MultisinePlan, label: RecordingLabel, seed: int
) -> Recording:
    """Run one experiment and read the instruments."""
    sensors, plant, command = config.sensors, excitation.plant, excitation.command
    period = excitation_torque(plan, label.realisation, label.experiment, label.sign)
    excited = np.tile(period[:, np.argsort(plan.joints)], (plan.periods, 1))
    log = run_loop(
        plant,
        excitation.gains,
        LoopCommand(command.torque + excited, command.position, command.rate),
        start=excitation.start,
        start_rate=excitation.start_rate,
        encoder_resolution=encoder_resolution(sensors),
        states=bool(excitation.sensors),
    )
    key = (plan.seed, label.pose, label.realisation, label.experiment, int(label.sign < 0))
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    samples = len(log.position)
    q, torque = (
        np.tile(read_encoder(sensors, excitation.pose), (samples, 1)),
        np.zeros((samples, len(excitation.pose))),
    )
    q[:, plant.joints] = log.position
    torque[:, plant.joints] = read_torque(sensors, log.torque, rng)
    arm = None
    if sensors.arm_encoders:
        arm = q.copy()
        arm[:, plant.joints] = read_encoder(sensors, log.arm)
    sensed = None
    if log.states is not None:
        on_arm = excitation.sensors
        true = arm_readings(excitation.truth, plant, on_arm, log.states, 1 / plan.rate_hz)
        noise = reading_noise(on_arm, sensors) * rng.standard_normal(true.shape)
        sensed = sensitivities(on_arm, seed) * true + noise
    return Recording(
        time_step=1 / plan.rate_hz,
        q=q,
        torque=torque,
        arm=arm,
        start=0.0,
        label=label,
        sensors=tuple(sensor.name for sensor in excitation.sensors),
        sensed=sensed,
    )
