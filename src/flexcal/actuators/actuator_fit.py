"""Fit of actuators to logs: simulated positions against measured ones, window by window."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from flexcal.actuators.determined import determined
from flexcal.actuators.output_error import OutputError
from flexcal.actuators.servo_parameters import Servo, ServoCoordinates
from flexcal.actuators.servo_simulation import ServoSimulation, Windows
from flexcal.actuators.smoothed_motion import SmoothedMotion
from flexcal.actuators.start_values import start_values
from flexcal.actuators.torque_scale import torques_without_effect
from flexcal.actuators.tracking_errors import TrackingErrors
from flexcal.data.recordings import CommandLog
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate, NotFinite, solve
from flexcal.export import COMPENSATED, OF_ERROR, Actuators
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

_LENGTH = 1.0
"""Part of a window that counts, s."""
_SETTLING = 6.0
"""Time constants of the slowest axis after which a window counts: errors of the state that it begins in have then decayed."""
_ROUGH = 0.05
"""Relative offset at which the first fit has converged."""
_SHARE = 0.2
"""Standard deviations that a parameter may be from the optimum in the mean; dry friction makes the cost too uneven to find it closer."""
_MOST_STEPS = 30
_UNLIKE, _ALIKE = 0.8, 0.9
"""Correlations of measured and commanded positions of which the columns of two joints are exchanged."""


@dataclass(frozen=True, eq=False)
class ActuatorFit:
    """Fitted actuators of n joints.

    estimate : what the logs do not tell is not identifiable in it; fitted, unseen : errors of simulated positions in the fit and in the
    windows held out; noise : (n,) of the measured positions, rad or m; settling : s, from the beginning of a window until it counts;
    windows : numbers of those fitted and held out.
    """

    estimate: Estimate
    actuators: Actuators
    fitted: TrackingErrors
    unseen: TrackingErrors
    noise: np.ndarray
    settling: float
    windows: tuple[int, int]


def fit_actuators(
    model: RobotModel,
    logs: Sequence[CommandLog],
    servo: Servo,
    *,
    hold_out: float = 0.25,
    threads: int = 1,
    progress: Progress = silent,
) -> ActuatorFit:
    """Least squares of simulated positions (Åström 1980: output error) over windows that begin in the measured state.

    A first fit with derivatives that are taken once leads near to the optimum, a second one to it. Every joint counts in units of its
    residual before. The last share `hold_out` of the windows of every log is not fitted. Covariance by the scatter of the windows'
    scores, joint by joint, which holds where residuals are correlated within a window (Liang & Zeger 1986). Raises `FlexcalError` where
    the logs are too short, or a joint does not move.
    """
    motions = [SmoothedMotion.of(log) for log in logs]
    _require_motion(model, logs, motions)
    first, links = start_values(
        model,
        logs,
        motions,
        follows_velocity=servo.follows_velocity,
        compensates_gravity=servo.compensates_gravity,
    )
    start = servo.applied(first)
    coordinates = ServoCoordinates(model, servo, links, start)
    simulation = ServoSimulation(model, start, links, threads=threads)
    settling = _SETTLING * simulation.slowest_time_constant(start)
    whole = [Windows.of(log, m, settling, _LENGTH) for log, m in zip(logs, motions, strict=True)]
    seen = [w.part(np.arange(len(w)) < np.ceil((1.0 - hold_out) * len(w))) for w in whole]
    unseen = [w.part(np.arange(len(w)) >= np.ceil((1.0 - hold_out) * len(w))) for w in whole]
    counts = sum(map(len, seen)), sum(map(len, unseen))
    if counts[0] <= len(servo.keys) + 1 or not counts[1]:
        raise FlexcalError(
            "E-DYN-045",
            f"the logs of {sum(log.duration for log in logs):.3g} s give {sum(counts)} windows of {_LENGTH:g} s, each after "
            f"{settling:.2g} s of settling, which is too few for {len(servo.keys)} parameters a joint; record longer.",
        )
    noise = np.sqrt(np.mean([motion.noise**2 for motion in motions], axis=0))
    error = OutputError(simulation, coordinates, [w for w in seen if len(w)])
    parameters = coordinates.parameters
    for rough in (True, False):
        residual = error.residual(parameters.coordinates())
        problem = error.problem(_rms(residual), parameters, rough=rough)
        with _diverging(logs[0].name):
            estimate = solve(
                problem,
                covariance="posterior" if rough else "sandwich",
                max_iterations=_MOST_STEPS,
                tolerance=_ROUGH if rough else _SHARE * np.sqrt(len(parameters) / residual.size),
                progress=lambda stage, share, late=not rough: progress(stage, 0.5 * (late + share)),
            )
        parameters = estimate.parameters
    found = coordinates.actuators(estimate.parameters.coordinates())
    fitted = TrackingErrors.of(simulation, found, seen)
    open_scale = torques_without_effect(simulation, found, seen, fitted.commanded) & ~coordinates.declared
    estimate = coordinates.natural(estimate)
    estimate = replace(
        estimate,
        identifiable=determined(model, servo, estimate, found, links, open_scale),
        covariance_freedom=float(counts[0] - len(servo.keys)),
        provenance={
            "option.damping": OF_ERROR if servo.follows_velocity else "velocity",
            "option.gravity": COMPENSATED if servo.compensates_gravity else "felt",
        },
    )
    return ActuatorFit(
        estimate,
        found,
        fitted,
        TrackingErrors.of(simulation, found, unseen),
        noise,
        settling,
        counts,
    )


@contextmanager
def _diverging(name: str) -> Iterator[None]:
    """Say of a simulation whose positions are not finite what is behind it."""
    try:
        yield
    except NotFinite as problem:
        raise FlexcalError(
            "E-DYN-051",
            f"no simulation comes near the motion in {name}; check that the joints turn as those of the URDF do, by sign, order and unit, "
            "and that its links have their masses.",
        ) from problem


def _rms(residual: np.ndarray) -> np.ndarray:
    """Root mean square (n,) of residuals (W, S, n), never zero."""
    return np.maximum(np.sqrt(np.mean(residual**2, axis=(0, 1))), 1e-12)


def _require_motion(model: RobotModel, logs: Sequence[CommandLog], motions: Sequence[SmoothedMotion]) -> None:
    moved = np.max([np.ptp(motion.q, axis=0) for motion in motions], axis=0)
    noise = np.max([motion.noise for motion in motions], axis=0)
    still = np.flatnonzero(moved <= 10 * noise)
    if still.size:
        name, unit = model.joint_names[still[0]], "m" if model.joints[still[0]].kind == "prismatic" else "rad"
        raise FlexcalError(
            "E-DYN-046",
            f"{name} moves by {moved[still[0]]:.3g} {unit} in all of {logs[0].name}"
            f"{' and others' if len(logs) > 1 else ''}, so nothing of its actuator shows; move every joint.",
        )
    q, command = (np.concatenate([getattr(log, name) for log in logs]) for name in ("q", "command"))
    if (np.ptp(q - command, axis=0) <= 1e-9 * np.ptp(q, axis=0)).any():
        joint = model.joint_names[int(np.argmin(np.ptp(q - command, axis=0)))]
        raise FlexcalError(
            "E-DYN-048",
            f"the measured positions of {joint} in {logs[0].name} are the commanded ones; log what its encoder reads.",
        )
    if (constant := np.ptp(command, axis=0) == 0).any():
        raise FlexcalError(
            "E-DYN-052",
            f"the commanded positions of {model.joint_names[int(np.argmax(constant))]} in {logs[0].name} stand still while it moves; log "
            "what its controller is asked for.",
        )
    likeness = np.corrcoef(q.T, command.T)[: model.n, model.n :]
    for i in range(model.n):
        j = int(np.argmax(np.abs(likeness[i])))
        if abs(likeness[i, i]) < _UNLIKE < _ALIKE < abs(likeness[i, j]):
            raise FlexcalError(
                "E-DYN-049",
                f"the measured positions of {model.joint_names[i]} in {logs[0].name} follow the commands of {model.joint_names[j]}, not "
                "its own; exchange the columns.",
            )
        if likeness[i, i] < -_ALIKE:
            raise FlexcalError(
                "E-DYN-050",
                f"{model.joint_names[i]} moves against its commands in {logs[0].name}; one of the two has another sign.",
            )
