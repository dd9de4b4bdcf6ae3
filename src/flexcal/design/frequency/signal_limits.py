"""Limits along the played signals of a frequency plan: joints, drives, gaps and tool, with the arm's elastic deflection."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.design.trajectories import MotionLimits
from flexcal.errors import InputError
from flexcal.frequency.periodic import (
    PlayedSchedule,
    envelope,
    multisine_spectra,
    reference_motion,
    synthesise,
)
from flexcal.model.robot import RobotModel
from flexcal.model.statics import elastic_axes, points_kinematics, static_equilibrium
from flexcal.model.vibration import (
    closed_loop_motion,
    drive_stretch,
    linearise,
    periodic_torque,
    spring_load,
)
from flexcal.progress import Progress, silent

_FINE = 16
"""Instants a period of the highest line: a peak between two is 2 % higher at most."""
_SLOW = 40
"""Instants a period of the reference motion at which the torques along it are computed."""
_LEAST_ROOM = 1e-12
"""Room, in SI units, that a limit at rest is taken to have."""
_SMOOTH = 0.01
"""Velocity of the reference motion below which Coulomb friction is taken as smaller, rad/s."""


@dataclass(frozen=True)
class SignalUse:
    """Largest use of a limit over all signals of a plan: `share` of it, 1 at the limit.

    `what` of which `joint` (a name, or of the tool) it is, with its `value` and the `limit` in `unit`, at `time` s of the signal of
    `pose`, `realisation`, `experiment` and `sign` (indices from 0, ±1). `factor` on the amplitudes brings all signals to the limit; 0
    where the reference motion alone passes it.
    """

    what: str
    joint: str
    unit: str
    value: float
    limit: float
    share: float
    factor: float
    time: float
    pose: int
    realisation: int
    experiment: int
    sign: int

    @property
    def passed(self) -> bool:
        """Whether the limit is passed."""
        return self.share > 1

    def __str__(self) -> str:
        beyond = abs(self.value - self.limit)
        signal = f"pose {self.pose + 1}, realisation {self.realisation + 1}, experiment {self.experiment + 1}"
        return (
            f"{self.what} of {self.joint} is {self.value:.4g} {self.unit} at {self.time:.3f} s of {signal}, sign {self.sign:+d}, "
            f"{beyond:.3g} {self.unit} beyond {self.limit:.4g}"
        )


@dataclass(frozen=True, eq=False)
class _Quantity:
    """Values `still` (N, c) along the reference motion, and `swung` (S, c): those that an excitation adds over one period, of c `joints`.

    They stay between `low` and `high` (c,).
    """

    what: str
    unit: str
    joints: tuple[str, ...]
    still: np.ndarray
    swung: np.ndarray
    low: np.ndarray
    high: np.ndarray


def signal_uses(
    model: RobotModel, plan: MultisinePlan, progress: Progress = silent, *, loop: PositionLoop | None = None
) -> dict[str, SignalUse]:
    """Largest use of every kind of limit along all signals of a plan, from soft start to soft stop; `loop` of a position-controlled robot.

    The controller is taken to follow the reference motion, along which the torques are those of the elastic robot in motion, with rotors
    and friction; the excitation adds the motion of the robot linearised in the pose, under the plan's gains. Positions are those of the
    motors and of the deflected arm. Torques stay below the URDF's efforts, and what the excitation adds in the spring of a drive with
    backlash below what gravity loads it with. robot.yaml's limits of the first point count too. Raises `InputError` where the plan excites
    a joint that robot.yaml does not declare elastic, and as `linearise` does.
    """
    model = _excited(model, plan)
    worst: dict[str, SignalUse] = {}
    for pose in range(len(plan.poses)):
        for use in _pose_uses(model, plan, pose, loop):
            before = worst.get(use.what, use)
            largest = use if use.share > before.share else before
            worst[use.what] = replace(largest, factor=min(use.factor, before.factor))
        progress("limits", (pose + 1) / len(plan.poses))
    return worst


_DAMPING = 0.7
"""Damping ratio of an assumed position loop."""


@dataclass(frozen=True, eq=False)
class PositionLoop:
    """Assumed position controller of a robot that takes no torques: gains `kp`, `kd` (n,), N m/rad and N m s/rad.

    `motions` (P, L, n_u, n_u), rad/(N m): reference that makes the torque of an axis, (C⁻¹ + G) with the controller C and the robot's
    receptance G in each pose.
    """

    kp: np.ndarray
    kd: np.ndarray
    motions: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, model: RobotModel, plan: MultisinePlan, bandwidth_hz: float) -> PositionLoop:
        """Loop of this bandwidth about the inertia of each excited axis, the mean over the poses; gains of other axes are the plan's.

        Raises `InputError` as `signal_uses`.
        """
        model = _excited(model, plan)
        axes = [joint.index for joint in model.driven]
        order = np.argsort([plan.joints.index(axis) for axis in axes])
        systems = [linearise(model, q, plan.payload) for q in plan.poses]
        stretch = drive_stretch(model, systems[0])
        twists = np.where(stretch.T > 0)[1]
        rigid = np.eye(len(stretch), len(axes))
        rigid[twists, range(len(axes))] = 1.0
        inertia = np.mean([np.diag(rigid.T @ system.mass @ rigid) for system in systems], axis=0)
        omega = 2 * np.pi * bandwidth_hz
        kp, kd = plan.kp.copy(), plan.kd.copy()
        kp[axes], kd[axes] = inertia * omega**2, 2 * _DAMPING * inertia * omega
        none = np.zeros(len(axes))
        rate = 2j * np.pi * plan.frequencies_hz[:, None]
        by_loop = np.eye(len(axes)) / (kp[axes] + kd[axes] * rate)[:, :, None]
        motions = []
        for system in systems:
            free = closed_loop_motion(system, plan.frequencies_hz, none, none)[:, : len(axes)]
            motions.append((by_loop + free)[:, order][:, :, order])
        return cls(kp, kd, tuple(motions))


def require_within_limits(uses: dict[str, SignalUse], scale: float) -> None:
    """Raise `InputError` that names all limits that are passed, and the scale in place of `scale` that would keep them."""
    passed = sorted((use for use in uses.values() if use.passed), key=lambda use: -use.share)
    if not passed:
        return
    factor = float(np.floor(1e3 * scale * min(use.factor for use in uses.values())) / 1e3)
    remedy = (
        f"give --scale {factor:g}"
        if factor > 0
        else "the reference motion alone does, so no --scale helps; give other poses or a smaller reference motion"
    )
    raise InputError(
        "E-EXP-022",
        f"the signals pass limits of the robot, so nothing is written: {'; '.join(map(str, passed))}; {remedy}.",
    )


def _excited(model: RobotModel, plan: MultisinePlan) -> RobotModel:
    """Robot whose other elastic joints are braked; raises `InputError` where an excited one is not elastic."""
    excited = [model.joint_names[joint] for joint in plan.joints]
    model = model.with_brakes(tuple(excited))
    driven = [joint.index for joint in model.driven]
    lacking = [name for name, joint in zip(excited, plan.joints, strict=True) if joint not in driven]
    if lacking:
        raise InputError(
            "E-EXP-021",
            f"{model.path} declares no drive spring of {lacking[0]}, which the plan excites; add it under `elastic:`.",
        )
    return model


def _pose_uses(
    model: RobotModel, plan: MultisinePlan, pose: int, loop: PositionLoop | None
) -> Iterator[SignalUse]:
    schedule = PlayedSchedule(plan)
    instants = 2 * int(np.ceil(_FINE * plan.lines[-1] / 2))
    step = 1 / (plan.base_frequency_hz * instants)
    start = schedule.ramp / plan.rate_hz
    time = np.arange(int(schedule.samples / plan.rate_hz / step)) * step
    share = envelope(schedule, time)[0]
    turn = np.rint((time - start) / step).astype(int) % instants
    still = _along_reference(model, plan, schedule, pose, time)
    swing = _by_excitation(model, plan, pose, instants, loop)
    for realisation, experiment in product(range(plan.realisations), range(plan.experiments)):
        added = swing(multisine_spectra(plan, realisation)[:, :, experiment])
        for quantity in _quantities(model, plan, pose, still, added, commanded=loop is not None):
            swung = share[:, None] * quantity.swung[turn]
            for sign in (1, -1) if plan.signs else (1,):
                found = _use(quantity, sign * swung)
                if found is None:
                    continue
                row, column, value, limit, used, factor = found
                yield SignalUse(
                    quantity.what,
                    quantity.joints[column],
                    quantity.unit,
                    value,
                    limit,
                    used,
                    factor,
                    float(time[row]),
                    pose,
                    realisation,
                    experiment,
                    sign,
                )


def _use(quantity: _Quantity, swung: np.ndarray) -> tuple[int, int, float, float, float, float] | None:
    """Place, value, limit, share of it, and factor on `swung` (N, c) that reaches it, of the largest use; None where nothing is limited."""
    low, high, value = quantity.low, quantity.high, quantity.still + swung
    above, below = np.isfinite(high), np.isfinite(low)
    if not (above | below).any():
        return None
    both = above & below
    middle = np.where(both, np.where(both, low, 0) / 2 + np.where(both, high, 0) / 2, quantity.still[0])
    upper = np.where(above, value - middle, 0.0) / np.where(
        above, np.maximum(high - middle, _LEAST_ROOM), 1.0
    )
    lower = np.where(below, middle - value, 0.0) / np.where(below, np.maximum(middle - low, _LEAST_ROOM), 1.0)
    use = np.maximum(upper, lower)
    row, column = (int(i) for i in np.unravel_index(np.argmax(use), use.shape))
    limit = high if upper[row, column] >= lower[row, column] else low
    if (quantity.still > high).any() or (quantity.still < low).any():
        factor = 0.0
    else:
        moves = swung != 0
        room = np.where(swung > 0, high - quantity.still, low - quantity.still)
        factor = float(np.min(room[moves] / swung[moves], initial=np.inf))
    return row, column, float(value[row, column]), float(limit[column]), float(use[row, column]), factor


@dataclass(frozen=True, eq=False)
class _Motion:
    """Position, velocity and torque (N, n) of the motors, and elastic coordinates (N, d): arm's position, or tilt of a bearing.

    `spring` (N, E): torque in each driven spring. `commanded` and its velocity (N, n): the reference.
    """

    position: np.ndarray
    velocity: np.ndarray
    torque: np.ndarray
    elastic: np.ndarray
    elastic_velocity: np.ndarray
    spring: np.ndarray
    commanded: np.ndarray
    commanded_velocity: np.ndarray


def _along_reference(
    model: RobotModel, plan: MultisinePlan, schedule: PlayedSchedule, pose: int, time: np.ndarray
) -> _Motion:
    """The motion without excitation at times (N,), s."""
    moved = np.isin(np.arange(model.n), plan.joints)
    length = (schedule.samples - 1) / plan.rate_hz
    rate = max(2 * _SLOW * plan.reference_frequency_hz, 50.0)
    count = 2 * int(np.ceil(length * rate / 2))
    slow = np.arange(count) * (length / count)
    angle, speed, acceleration = (x[:, None] * moved for x in reference_motion(schedule, slow))
    q = plan.poses[pose] + angle
    torque = periodic_torque(model, q, speed, acceleration, length, plan.payload)
    omega = 2j * np.pi / length * np.arange(count // 2 + 1)[:, None]

    def derivatives(bent: np.ndarray) -> np.ndarray:
        lines = np.fft.rfft(bent, axis=0)
        return np.array([np.fft.irfft(lines * omega**order, n=count, axis=0) for order in range(3)])

    load = spring_load(model, q, speed, acceleration, derivatives, plan.payload)
    axes = elastic_axes(model)
    bent = load / np.array([model.springs.stiffness[axis] for axis in axes])
    rotor, viscous, coulomb = np.nan_to_num(
        [model.drives.rotor_inertia, model.drives.viscous, model.drives.coulomb]
    )
    torque = torque + rotor * acceleration + viscous * speed + coulomb * np.tanh(speed / _SMOOTH)
    base = np.array([q[:, joint] if component == 2 else 0 * q[:, joint] for joint, component in axes]).T
    elastic = base + bent
    driven = [axes.index((joint.index, 2)) for joint in model.driven]
    parts = (q, speed, torque, elastic, derivatives(elastic)[1], load[:, driven], q, speed)
    return _Motion(*(_interpolated(slow, part, time) for part in parts))


def _interpolated(at: np.ndarray, values: np.ndarray, time: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(time, at, column) for column in values.T], axis=1)


def _by_excitation(
    model: RobotModel, plan: MultisinePlan, pose: int, instants: int, loop: PositionLoop | None
) -> Callable[[np.ndarray], _Motion]:
    """What phasors of torque (L, n_u) add to the motion over a period, at so many instants."""
    axes = [joint.index for joint in model.driven]
    order = [plan.joints.index(axis) for axis in axes]
    system = linearise(model, plan.poses[pose], plan.payload)
    # a reference that makes these very torques leaves the motion of the robot without a controller
    kp, kd = (gains[axes] * (loop is None) for gains in (plan.kp, plan.kd))
    moved = closed_loop_motion(system, plan.frequencies_hz, kp, kd)
    asked = None if loop is None else loop.motions[pose][:, order][:, :, order]
    stiffness = np.array([joint.stiffness[2] for joint in model.driven])
    stretch = stiffness[:, None] * drive_stretch(model, system).T
    rate = 2j * np.pi * plan.frequencies_hz[:, None]

    def added(phasors: np.ndarray) -> _Motion:
        torque = phasors[:, order]
        motion = np.einsum("lij,lj->li", moved, torque)
        motors, elastic = motion[:, : len(axes)], motion[:, len(axes) :]
        feedback = (kp + kd * rate) * motors
        commanded = motors if asked is None else np.einsum("lij,lj->li", asked, torque)
        spring = motion @ stretch.T

        def over(values: np.ndarray) -> np.ndarray:
            return synthesise(values, plan.lines, instants)

        def of_all(values: np.ndarray) -> np.ndarray:
            result = np.zeros((instants, model.n))
            result[:, axes] = over(values)
            return result

        return _Motion(
            of_all(motors),
            of_all(motors * rate),
            of_all(torque - feedback),
            over(elastic),
            over(elastic * rate),
            over(spring),
            of_all(commanded),
            of_all(commanded * rate),
        )

    return added


def _quantities(
    model: RobotModel, plan: MultisinePlan, pose: int, still: _Motion, added: _Motion, *, commanded: bool
) -> Iterator[_Quantity]:
    limits, names = MotionLimits.of(model), model.joint_names
    lower, upper = (np.array([getattr(joint, side) for joint in model.joints]) for side in ("lower", "upper"))
    axes = elastic_axes(model)
    twists = [k for k, (_, component) in enumerate(axes) if component == 2]
    sprung = [axes[k][0] for k in twists]
    yield _Quantity("the motor position", "rad", names, still.position, added.position, lower, upper)
    yield _Quantity(
        "the position of the deflected arm",
        "rad",
        tuple(names[joint] for joint in sprung),
        still.elastic[:, twists],
        added.elastic[:, twists],
        lower[sprung],
        upper[sprung],
    )
    yield _Quantity(
        "the velocity", "rad/s", names, still.velocity, added.velocity, -limits.velocity, limits.velocity
    )
    if commanded:
        reference = still.commanded, added.commanded
        yield _Quantity("the commanded position", "rad", names, *reference, lower, upper)
        rates = still.commanded_velocity, added.commanded_velocity
        yield _Quantity("the commanded velocity", "rad/s", names, *rates, -limits.velocity, limits.velocity)
    yield _Quantity("the torque", "N m", names, still.torque, added.torque, -limits.torque, limits.torque)
    loose = [k for k, joint in enumerate(model.driven) if joint.index in model.backlash_joints]
    if loose:
        rest = static_equilibrium(model, plan.poses[pose][None], plan.payload)
        preload = np.abs(rest.torque[0, [model.driven[k].index for k in loose]])
        yield _Quantity(
            "the torque by the excitation in the preloaded drive",
            "N m",
            tuple(model.driven[k].name for k in loose),
            np.zeros((len(still.position), len(loose))),
            added.spring[:, loose],
            -preload,
            preload,
        )
    if limits.cartesian:
        yield from _of_tool(model, plan, pose, still, added, limits)


def _of_tool(
    model: RobotModel, plan: MultisinePlan, pose: int, still: _Motion, added: _Motion, limits: MotionLimits
) -> Iterator[_Quantity]:
    """Position and speed of the first point, linear in the motion about the pose at rest."""
    q = plan.poses[pose][None]
    target = np.array([next(iter(model.points))])
    rest = static_equilibrium(model, q, plan.payload)
    at = points_kinematics(model, q, rest.deflection, target, jacobians=True)
    by_motion = at.motion_jacobian[0, :3]
    axes = elastic_axes(model)
    by_elastic = np.stack([by_motion[:, joint, component] for joint, component in axes], axis=1)
    rigid = np.array([joint not in model.springs.bearing_frames for joint in range(model.n)])
    by_rigid = by_motion[:, :, 2] * rigid
    base = np.array([q[0, joint] if component == 2 else 0.0 for joint, component in axes])
    base = base + np.array([rest.deflection[0, joint, component] for joint, component in axes])
    place = at.position[0] + (still.elastic - base) @ by_elastic.T + (still.position - q) @ by_rigid.T
    moved = added.elastic @ by_elastic.T + added.position @ by_rigid.T
    tool = tuple(f"the point '{target[0]}' along {axis}" for axis in "xyz")
    yield _Quantity("the reach", "m", tool, place, moved, *limits.box)
    speed = still.elastic_velocity @ by_elastic.T + still.velocity @ by_rigid.T
    swung = added.elastic_velocity @ by_elastic.T + added.velocity @ by_rigid.T
    # the speed is below what its parts are at most together
    top = np.linalg.norm(speed, axis=1)[:, None]
    most = np.repeat(np.linalg.norm(swung, axis=1).max(keepdims=True)[:, None], len(swung), axis=0)
    fastest = np.array([limits.speed])
    yield _Quantity("the speed", "m/s", (f"the point '{target[0]}'",), top, most, -fastest, fastest)
