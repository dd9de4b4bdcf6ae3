"""Exciting trajectories on the virtual robot: all joints follow their series at once, motors and torques are logged."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexcal.data.experiments import labels
from flexcal.data.plans import TrajectoryPlan
from flexcal.data.recordings import Recording
from flexcal.errors import FlexcalError
from flexcal.model.robot import RobotModel
from flexcal.virtual_cell.closed_loop import LoopCommand, LoopGains, run_loop
from flexcal.virtual_cell.config import CellConfig
from flexcal.virtual_cell.equilibrium import rest
from flexcal.virtual_cell.feed_forward import rigid_inverse_dynamics
from flexcal.virtual_cell.sensors import encoder_resolution, read_encoder, read_torque
from flexcal.virtual_cell.step_size import resolved_plant

_TRAJECTORY = 2**33  # keeps these random numbers apart from those of the other experiments


def trajectory_recordings(
    truth: RobotModel, believed: RobotModel, config: CellConfig, plan: TrajectoryPlan, seed: int
) -> Iterator[Recording]:
    """The recordings of a plan in its order; each a function of `seed` and its number alone."""
    import mujoco

    if plan.torque == "instantaneous":
        raise FlexcalError(
            "E-CELL-028",
            "the virtual cell's torque is held over a sample, not instantaneous; write `tau: held` in the plan.",
        )
    if plan.kp is None or plan.kd is None:
        raise FlexcalError(
            "E-CELL-029",
            "the plan has no gains, which the virtual cell's controller needs; add `controller: {kp: […], kd: […], rate_hz: 4000}` to "
            "robot.yaml and design it again.",
        )
    everything = range(truth.n)
    samples = plan.periods * plan.samples_per_period
    for number, label in enumerate(labels(plan)):
        q, dq, ddq = plan.motion(number, np.arange(samples) / plan.rate_hz)
        plant, substeps = resolved_plant(
            truth, config, q=q[0], free=everything, payload=plan.payload, rate_hz=plan.rate_hz
        )
        torque = rigid_inverse_dynamics(believed, config, q, dq, ddq, plan.payload)
        start = rest(plant, mujoco.MjData(plant.mjmodel), q[0]).position
        start_rate = np.zeros_like(start)
        start_rate[plant.motors] = dq[0]
        log = run_loop(
            plant,
            LoopGains(plan.kp, plan.kd, plan.rate_hz, substeps, config.controller.rate_filter_hz),
            LoopCommand(torque, q, dq),
            start=start,
            start_rate=start_rate,
            encoder_resolution=encoder_resolution(config.sensors),
        )
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(plan.seed, _TRAJECTORY, number)))
        yield Recording(
            time_step=1 / plan.rate_hz,
            q=log.position,
            torque=read_torque(config.sensors, log.torque, rng),
            arm=read_encoder(config.sensors, log.arm) if config.sensors.arm_encoders else None,
            label=label,
        )
