"""Simulation of a position-controlled robot in MuJoCo, from measured states and commands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from flexcal.actuators.smoothed_motion import SmoothedMotion
from flexcal.data.recordings import CommandLog
from flexcal.export import Actuators, mjcf_spec
from flexcal.model.robot import RobotModel

if TYPE_CHECKING:
    import mujoco

_LONGEST_STEP = 2.5e-4
"""Time step of the simulation, s, at most: a whole fraction of that of the log, and of the fastest time constant. Damping and dry friction
of an arm whose encoders scatter by 0.02 mrad are outside of their intervals with 1 ms."""
_STEPS_A_TIME_CONSTANT = 8.0
_LEAST_DECAY, _MOST_DECAY = 3.0, 60.0
"""Bounds of the slowest rate of decay, 1/s, by which windows settle."""


@dataclass(frozen=True, eq=False)
class Windows:
    """W windows of one log: each begins in the measured state, and counts from its sample `settled` on.

    state : (W, 2, n) position and velocity at the beginning, rad and rad/s; first : (W,) number of that sample in the log;
    measured : (W, S, n) positions at the S samples that count.
    """

    log: CommandLog
    state: np.ndarray
    first: np.ndarray
    settled: int
    measured: np.ndarray

    def __len__(self) -> int:
        return len(self.first)

    @classmethod
    def of(cls, log: CommandLog, motion: SmoothedMotion, settling: float, length: float) -> Windows:
        """Windows whose counting parts of `length` (s) follow each other without a gap, each after `settling` (s)."""
        before, counted = round(settling / log.time_step), max(round(length / log.time_step), 2)
        count = max((len(log) - 1 - before) // counted, 0)
        first = counted * np.arange(count)
        samples = first[:, None] + before + 1 + np.arange(counted)
        return cls(log, np.stack([motion.q[first], motion.dq[first]], axis=1), first, before, log.q[samples])

    def part(self, chosen: np.ndarray) -> Windows:
        """The windows marked in `chosen` (W,)."""
        return replace(
            self, state=self.state[chosen], first=self.first[chosen], measured=self.measured[chosen]
        )


class ServoSimulation:
    """A rigid robot with actuators, of which the parameters can be changed; `threads` simulate at a time.

    `links` (n,): inertia of the links on every joint, as it is mostly.
    """

    def __init__(self, model: RobotModel, start: Actuators, links: np.ndarray, *, threads: int = 1) -> None:
        import mujoco
        from mujoco.rollout import Rollout

        spec = mjcf_spec(model.without_springs(), actuators=start)
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_CONTACT
        self._compiled = spec.compile()
        self._data = [mujoco.MjData(self._compiled) for _ in range(threads)]
        self._rollout = Rollout(nthread=threads)
        joints = [self._compiled.joint(name) for name in model.joint_names]
        self._positions = np.array([joint.qposadr[0] for joint in joints])
        self._speeds = np.array([joint.dofadr[0] for joint in joints])
        self._drives = np.array([self._compiled.actuator(name).id for name in model.joint_names])
        self._followers = self._drives + 1 if start.follows_velocity else None
        self.links = links
        rates = self._rates(start)
        self._step = min(_LONGEST_STEP, 1.0 / (_STEPS_A_TIME_CONSTANT * float(np.abs(rates).max())))

    def slowest_time_constant(self, actuators: Actuators) -> float:
        """Time constant, s, of the joint that forgets its state last, at its mean inertia."""
        decay = float(-np.real(self._rates(actuators)).max())
        return 1.0 / min(max(decay, _LEAST_DECAY), _MOST_DECAY)

    def _rates(self, actuators: Actuators) -> np.ndarray:
        """Poles (n, 2), 1/s, of every joint alone: roots of M s² + D s + K."""
        inertia = self.links + actuators.armature
        half = 0.5 * (actuators.damping + actuators.viscous) / inertia
        root = np.sqrt((half**2 - actuators.stiffness / inertia).astype(complex))
        return np.stack([-half + root, -half - root], axis=1)

    def positions(self, actuators: Actuators, windows: Windows, *, coarse: bool = False) -> np.ndarray:
        """Simulated positions (W, S, n) at the samples of the windows that count; `coarse`: with eight times as long time steps."""
        log = windows.log
        substeps = int(np.ceil(log.time_step / (8 * self._step if coarse else self._step) - 1e-9))
        compiled = self._with(actuators, log.time_step / substeps)
        samples = windows.settled + windows.measured.shape[1]
        states = np.zeros((len(windows), 1 + compiled.nq + compiled.nv))
        states[:, 1 + self._positions] = windows.state[:, 0]
        states[:, 1 + compiled.nq + self._speeds] = windows.state[:, 1]
        control = self._control(actuators, windows, samples, substeps)
        path, _ = self._rollout.rollout(compiled, self._data, states, control)
        reached = np.arange(windows.settled + 1, samples + 1) * substeps - 1
        return np.asarray(path)[:, reached][:, :, 1 + self._positions]

    def _control(self, actuators: Actuators, windows: Windows, samples: int, substeps: int) -> np.ndarray:
        """Commands (W, steps, ·) at the beginning of every step, delayed, between samples by linear interpolation."""
        log = windows.log
        step = log.time_step / substeps
        times = np.arange(samples * substeps) * step + windows.first[:, None] * log.time_step
        known = log.time_step * np.arange(len(log))
        control = np.zeros((*times.shape, self._compiled.nu))
        for i, drive in enumerate(self._drives):
            at, command = times - actuators.delay[i], log.command[:, i]
            control[:, :, drive] = np.interp(at, known, command)
            if self._followers is not None:
                ends = (np.interp(at + side * step, known, command) for side in (0.5, -0.5))
                control[:, :, self._followers[i]] = np.subtract(*ends) / step
        return control

    def _with(self, actuators: Actuators, step: float = 0.0) -> mujoco.MjModel:
        """The compiled robot with other actuators, for a time step (s).

        MuJoCo evaluates the damping at the end of a step; taking half a step of it off the inertia moves it to the middle, where the error
        of the trapezoidal rule is of second order (Hairer, Lubich & Wanner 2006, section VI.3).
        """
        import mujoco

        compiled = self._compiled
        compiled.opt.timestep = step
        half = 0.5 * step * (actuators.damping + actuators.viscous)
        compiled.dof_armature[self._speeds] = actuators.armature - half
        compiled.dof_frictionloss[self._speeds] = actuators.coulomb
        compiled.dof_damping[self._speeds] = actuators.viscous
        compiled.actuator_gainprm[self._drives, 0] = actuators.stiffness
        compiled.actuator_biasprm[self._drives, 1] = -actuators.stiffness
        compiled.actuator_biasprm[self._drives, 2] = -actuators.damping
        if self._followers is not None:
            compiled.actuator_gainprm[self._followers, 0] = actuators.damping
        mujoco.mj_setConst(compiled, self._data[0])
        return compiled
