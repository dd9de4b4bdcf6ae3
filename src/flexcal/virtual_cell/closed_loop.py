"""The closed loop over a plant: sampled controller, hold, MuJoCo's steps, all in C++ without the interpreter lock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.kernels import closed_loop
from flexcal.mujoco_library import step_address
from flexcal.virtual_cell.plant import Plant


@dataclass(frozen=True, eq=False)
class LoopGains:
    """A sampled PD: gains (m,) N m/rad and N m s/rad, `rate_hz` of its ticks, plant steps per tick, corner of the rate filter (Hz)."""

    kp: np.ndarray
    kd: np.ndarray
    rate_hz: float
    substeps: int = 1
    rate_filter_hz: float = np.inf


@dataclass(frozen=True, eq=False)
class LoopCommand:
    """Command of the loop, all (ticks, m): torque added to the PD's, reference position and rate."""

    torque: np.ndarray
    position: np.ndarray
    rate: np.ndarray


@dataclass(frozen=True, eq=False)
class LoopLog:
    """Log of the loop, all (ticks, m): encoder position at the tick, torque applied until the next, true arm position.

    `states` (ticks, d) are all coordinates of the plant at the tick, where they were asked for.
    """

    position: np.ndarray
    torque: np.ndarray
    arm: np.ndarray
    states: np.ndarray | None = None


def run_loop(
    plant: Plant,
    gains: LoopGains,
    command: LoopCommand,
    *,
    start: np.ndarray,
    start_rate: np.ndarray,
    encoder_resolution: float = 0.0,
    states: bool = False,
) -> LoopLog:
    """Run the loop from a position (d,) and the rate (d,) half a plant step before; with `states` all coordinates are logged. Raises
    `FlexcalError` where it diverges.

    A plant step is MuJoCo's semi-implicit Euler, M (q₊ − 2 q + q₋)/h² = τ̄ − forces; how τ̄ and the forces are taken so that the
    torque is held exactly, springs are right to fourth and dampers to third order is in `flexcal.virtual_cell.plant`.
    """
    import mujoco

    model = plant.mjmodel
    step = 1 / (gains.rate_hz * gains.substeps)
    if not np.isclose(model.opt.timestep, step, rtol=1e-12):
        raise FlexcalError(
            "E-CELL-014",
            f"the plant steps by {model.opt.timestep:g} s but the controller needs {step:g} s; rebuild the plant.",
        )
    data = mujoco.MjData(model)
    data.qpos[:] = start
    data.qvel[:] = start_rate
    shape = command.torque.shape
    log = LoopLog(
        np.empty(shape), np.empty(shape), np.empty(shape), np.empty((shape[0], model.nv)) if states else None
    )
    done = closed_loop(
        step=step_address(),
        model=model._address,
        data=data._address,
        position=data.qpos,
        velocity=data.qvel,
        force=data.qfrc_applied,
        springs=plant.springs,
        frictions=plant.frictions,
        motors=plant.motors,
        twists=plant.twists,
        proportional=np.ascontiguousarray(gains.kp, dtype=float),
        derivative=np.ascontiguousarray(gains.kd, dtype=float),
        tick=1 / gains.rate_hz,
        substeps=gains.substeps,
        encoder_resolution=encoder_resolution,
        rate_filter=-np.expm1(-2 * np.pi * gains.rate_filter_hz / gains.rate_hz),
        feed_forward=np.ascontiguousarray(command.torque),
        reference=np.ascontiguousarray(command.position),
        reference_rate=np.ascontiguousarray(command.rate),
        position_log=log.position,
        torque_log=log.torque,
        arm_log=log.arm,
        **({} if log.states is None else {"state_log": log.states}),
    )
    if done < shape[0]:
        raise FlexcalError(
            "E-CELL-015",
            f"the virtual robot's loop diverged after {done / gains.rate_hz:.3g} s; lower kp, kd or the excitation.",
        )
    return log
