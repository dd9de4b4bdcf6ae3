"""Exciting trajectories: random feasible Fourier series, of which the most informative are kept (Swevers 1997)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data import TrajectoryPlan
from flexcal.design.collision import CollisionChecker
from flexcal.errors import FlexcalError, InputError
from flexcal.model import RobotModel, inertial_parameters, torque_regressor
from flexcal.model.declared import declared, uncertain_inertials
from flexcal.model.joint_space import joint_ranges

BASE_FREQUENCY_HZ = 0.2
HARMONICS = 5
PERIODS, SETTLE_PERIODS = 3, 1
SPEED, EFFORT = 0.8, 0.8
"""Largest velocity and torque, relative to the limits of a joint."""
RANGE = 0.8
"""Largest swing, relative to the range of a joint."""
_INSTANTS = 200
_TRIES = 200
_STEP = 1e-4
_TORQUE_ERROR = 1e-3
"""1σ of an instant's torque for the criterion, relative to the joint's effort."""


def design_trajectories(
    model: RobotModel, count: int, *, candidates: int, seed: int, payload: float | None = None
) -> TrajectoryPlan:
    """`count` trajectories out of `candidates` random ones that keep limits and touch nothing.

    One after the other, each raises log det of the posterior information of link inertials and rotors most, beside free friction and
    with robot.yaml's prior. `payload` kg is what the robot holds then; limits are checked with the rigid robot without it. Raises
    `FlexcalError` where the robot declares no controller, or too few candidates are feasible.
    """
    if model.controller is None:
        raise InputError(
            f"{model.path} declares no controller; add `controller: {{kp: […], kd: […], rate_hz: 4000}}`."
        )
    rng = np.random.default_rng(seed)
    checker = CollisionChecker(model)
    found: list[Candidate] = []
    for _ in range(_TRIES * candidates):
        drawn = Candidate.drawn(model, rng)
        if drawn.feasible(model, checker):
            found.append(drawn)
            if len(found) == candidates:
                break
    if len(found) < count:
        raise FlexcalError(
            f"of {_TRIES * candidates} random trajectories of {model.name} only {len(found)} keep its limits and touch nothing; "
            "check limits and obstacles."
        )
    best = _most_informative(model, found, count)
    return TrajectoryPlan(
        name="exciting",
        centre=np.array([c.centre for c in best]),
        sine=np.array([c.sine for c in best]),
        cosine=np.array([c.cosine for c in best]),
        payload=payload,
        base_frequency_hz=BASE_FREQUENCY_HZ,
        periods=PERIODS,
        settle_periods=SETTLE_PERIODS,
        kp=np.array(model.controller.kp),
        kd=np.array(model.controller.kd),
        rate_hz=model.controller.rate_hz,
        torque="held",
        seed=seed,
    )


@dataclass(frozen=True, eq=False)
class Candidate:
    """One trajectory: `centre` (n,), `sine` and `cosine` (n, H), and `motion` (3, instants, n): q, q̇, q̈ over one period."""

    centre: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray
    motion: np.ndarray

    @classmethod
    def drawn(cls, model: RobotModel, rng: np.random.Generator) -> Candidate:
        """Random amplitudes, scaled to a random share of what speed and range allow, about a random place within the range."""
        lower, upper = joint_ranges(model)
        fastest = np.array([joint.velocity for joint in model.joints])
        sine, cosine = rng.standard_normal((2, model.n, HARMONICS))
        q, dq, _ = _series(sine, cosine)
        allowed = np.minimum(
            RANGE * (upper - lower) / np.ptp(q, axis=0), SPEED * fastest / np.abs(dq).max(axis=0)
        )
        scale = (allowed * rng.uniform(0.3, 1.0, model.n))[:, None]
        sine, cosine = scale * sine, scale * cosine
        q, dq, ddq = _series(sine, cosine)
        centre = rng.uniform(lower - q.min(axis=0), upper - q.max(axis=0))
        return cls(centre, sine, cosine, np.array([q + centre, dq, ddq]))

    def feasible(self, model: RobotModel, checker: CollisionChecker) -> bool:
        """Whether no torque comes near its limit and nothing touches."""
        q, dq, ddq = self.motion
        rotor, viscous, coulomb = np.nan_to_num([model.rotor_inertia, model.viscous, model.coulomb])
        torque = torque_regressor(model, q, dq, ddq) @ inertial_parameters(model)
        torque = torque + rotor * ddq + viscous * dq + coulomb * np.sign(dq)
        efforts = np.array([joint.effort for joint in model.joints])
        return bool((np.abs(torque) <= EFFORT * efforts).all() and not checker.collides(q).any())

    def information(self, model: RobotModel, directions: np.ndarray) -> np.ndarray:
        """Information (p, p) on the unknowns in units of their prior, free friction eliminated; see `_directions` for (10 n, p - n)."""
        q, dq, ddq = self.motion
        efforts = _TORQUE_ERROR * np.array([joint.effort for joint in model.joints])
        links = torque_regressor(model, q, dq, ddq) @ directions
        rows = []
        for joint in range(model.n):
            rotor = np.zeros((len(q), model.n))
            rotor[:, joint] = (
                model.prior.rotor_inertia * np.nan_to_num(model.rotor_inertia[joint]) * ddq[:, joint]
            )
            friction = np.column_stack([dq[:, joint], np.sign(dq[:, joint]), np.ones(len(q))])
            basis = np.linalg.qr(friction)[0]
            wanted = np.hstack([links[:, joint], rotor]) / efforts[joint]
            rows.append(wanted - basis @ (basis.T @ wanted))
        jacobian = np.vstack(rows)
        return jacobian.T @ jacobian


def _series(sine: np.ndarray, cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Motion (instants, n) about zero over one period."""
    omega = 2 * np.pi * BASE_FREQUENCY_HZ * np.arange(1, HARMONICS + 1)
    phase = np.arange(_INSTANTS)[:, None] / (_INSTANTS * BASE_FREQUENCY_HZ) * omega
    s, c = np.sin(phase), np.cos(phase)
    return (
        s @ (cosine / omega).T - c @ (sine / omega).T,
        c @ cosine.T + s @ sine.T,
        c @ (sine * omega).T - s @ (cosine * omega).T,
    )


def _most_informative(model: RobotModel, found: list[Candidate], count: int) -> list[Candidate]:
    directions = _directions(model)
    each = [candidate.information(model, directions) for candidate in found]
    total, left, best = np.eye(len(each[0])), list(range(len(found))), []
    for _ in range(count):
        gain = [np.linalg.slogdet(total + each[k])[1] for k in left]
        chosen = left.pop(int(np.argmax(gain)))
        total = total + each[chosen]
        best.append(found[chosen])
    return best


def _directions(model: RobotModel) -> np.ndarray:
    """Change (10 n, p) of the links' inertial parameters by one prior standard deviation of each unknown."""
    names = uncertain_inertials(model, range(model.n))
    start = inertial_parameters(model)
    directions = np.empty((len(start), len(names)))
    for k, name in enumerate(names):
        item = declared(model, name)
        x = item.coordinate(item.value) + _STEP * item.prior_std
        directions[:, k] = (inertial_parameters(model.with_values({name: item.natural(x)})) - start) / _STEP
    return directions
