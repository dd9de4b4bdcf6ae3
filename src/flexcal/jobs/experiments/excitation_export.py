"""Signals of a frequency plan as files that a robot's controller plays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil, log10
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.data.experiments import PLAN
from flexcal.data.plans import MultisinePlan, TimedPositions, read_plan_of, write_plan
from flexcal.data.recordings import RecordingLabel
from flexcal.data.tables import UNITS, mapped_signals, standard_columns, write_table
from flexcal.design.frequency import PositionLoop, SignalUse, require_within_limits, signal_uses
from flexcal.design.scene import CollisionChecker
from flexcal.design.trajectories import MotionLimits
from flexcal.errors import InputError
from flexcal.files.formats import sha256_of
from flexcal.frequency.periodic import PlayedSchedule, PlayedSignal, multisine_spectra, played_signals
from flexcal.jobs.inputs import robot_file
from flexcal.model.robot import RobotModel
from flexcal.model.statics import tool_at_rest
from flexcal.progress import Progress, silent

MANIFEST, MOVES, PHASES = "manifest.csv", "moves.csv", "phases.csv"
Format = Literal["csv", "parquet", "ros", "mcap"]
_ENDINGS = {"csv": ".csv", "parquet": ".parquet", "ros": ".yaml", "mcap": ".mcap"}
_WHOLE = (".yaml", ".mcap")
"""Endings of trajectories of ROS, which a controller plays from beginning to end."""
_DIGITS = 9
"""Significant digits of written values, of the largest of a column."""
_MOVE_SHARE = 0.1
"""Share of the velocity limits that a move between poses uses."""
_COUNTED = ("pose", "realisation", "experiment")
_MOVE_INSTANTS = 100
"""Instants of a move at which collisions are checked."""
_MOVE_RATE = 0.5
"""Largest velocity of a joint in a move whose limit is unknown, rad/s or m/s."""


@dataclass(frozen=True, eq=False)
class ExportedExcitation:
    """Files in `folder` of the `plan` as it is played: `rows` of the manifest and of the `moves`, largest `uses` of limits, `remarks`."""

    folder: Path
    plan: MultisinePlan
    rows: tuple[dict[str, Any], ...]
    moves: tuple[dict[str, Any], ...]
    uses: tuple[SignalUse, ...]
    remarks: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        return {
            "folder": self.folder,
            "plan": self.folder / PLAN,
            "rate_hz": self.plan.rate_hz,
            "signals": list(self.rows),
            "moves": list(self.moves),
            "limits": [vars(use) | {key: vars(use)[key] + 1 for key in _COUNTED} for use in self.uses],
            "seconds_on_the_robot": sum(row["play_s"] for row in self.rows)
            + sum(row["duration_s"] for row in self.moves),
            "remarks": list(self.remarks),
        }


def export_excitation(
    plan_file: Path,
    out: Path,
    *,
    robot: Path | None = None,
    rate_hz: float | None = None,
    scale: float = 1.0,
    bandwidth_hz: float | None = None,
    whole: bool = False,
    format: Format = "csv",
    progress: Progress = silent,
) -> ExportedExcitation:
    """Write the signals of the frequency plan in a file to the folder `out`, one file a recording, with manifest.csv.

    `rate_hz` is the controller's (default: the plan's), `scale` multiplies the amplitudes; both go into `out`/plan.yaml, the plan as it is
    played. With `bandwidth_hz` the robot takes positions alone, through a controller of about this bandwidth: the reference makes the
    plan's torques (`PositionLoop`). A file holds one period of excitation and reference motion, or with `whole`, and as ROS
    trajectories (`format` ros or mcap), all of them. Raises `FlexcalError` where the plan does not fit the robot of robot.yaml, lines do
    not fit the rate, the robot touches something, or a limit is passed (`signal_uses`).
    """
    model = RobotModel.from_yaml(robot_file(plan_file, robot))
    plan = read_plan_of(plan_file, MultisinePlan)
    if plan.joint_count != model.n:
        raise InputError(
            "E-EXP-012",
            f"{plan_file}: the plan is for {plan.joint_count} joints, but {model.path} has {model.n}; give the plan of this robot.",
        )
    played = replace(
        plan, rate_hz=plan.rate_hz if rate_hz is None else rate_hz, amplitude=scale * plan.amplitude
    )
    loop = None if bandwidth_hz is None else PositionLoop.of(model, played, bandwidth_hz)
    if loop is not None:
        played = replace(played, kp=loop.kp, kd=loop.kd)
    uses = signal_uses(model, played, progress, loop=loop)
    require_within_limits(uses, scale)
    checker = CollisionChecker(model)
    _require_free(checker, played)
    schedule = PlayedSchedule(played)
    write_plan(out / PLAN, played)
    write_table(out / PHASES, _phases(played))
    total = len(played.poses) * played.recordings_per_pose
    ending = _ENDINGS[format]
    rows, whole = [], whole or ending in _WHOLE
    motions = None if loop is None else loop.motions
    for number, signal in enumerate(played_signals(played, whole=whole, motions=motions), start=1):
        name = _label(signal).name + ending
        torque = None if loop is not None else signal.torque
        _write(out / name, model, signal.time, signal.position, signal.velocity, torque)
        rows.append(_row(schedule, signal, name, whole) | {"sha256": sha256_of(out / name)})
        progress("signals", number / total)
    write_table(out / MANIFEST, _as_columns(rows))
    moves, touching = _write_moves(out, ending, model, played, checker)
    remarks = _remarks(schedule, whole)
    if touching:
        remarks.append(
            f"the straight move from pose {', '.join(touching)} would touch something or leave the limits of the tool, and is not written: "
            "move there by a way of your own"
        )
    if not checker.pairs:
        remarks.append(
            "the URDF has no collision shapes, so collisions of poses and moves are not excluded: run them in a simulator, or slowly, first"
        )
    return ExportedExcitation(out, played, tuple(rows), tuple(moves), tuple(uses.values()), tuple(remarks))


def _write_moves(
    out: Path, ending: str, model: RobotModel, plan: MultisinePlan, checker: CollisionChecker
) -> tuple[list[dict[str, Any]], list[str]]:
    """Rows of the moves that are written, with moves.csv, and which are not because something would be touched."""
    moves, touching = [], []
    for number, (time, q, dq) in enumerate(_moves(model, plan), start=1):
        instants = q[np.linspace(0, len(q) - 1, _MOVE_INSTANTS).astype(int)]
        if checker.collides(instants).any() or _leaves_box(model, instants):
            touching.append(f"{number} to {number + 1}")
            continue
        name = f"move_{number}{ending}"
        _write(out / name, model, time, q, dq)
        move = {
            "file": name,
            "from_pose": number,
            "to_pose": number + 1,
            "rate_hz": plan.rate_hz,
            "duration_s": float(time[-1]),
            "sha256": sha256_of(out / name),
        }
        moves.append(move)
    if moves:
        write_table(out / MOVES, _as_columns(moves))
    return moves, touching


def _write(
    file: Path,
    model: RobotModel,
    time: np.ndarray,
    q: np.ndarray,
    dq: np.ndarray,
    torque: np.ndarray | None = None,
) -> None:
    """Write a motion as a trajectory of ROS, or as a table, by the name's ending."""
    if file.suffix in _WHOLE:
        TimedPositions(model.joint_names, time, q, dq, effort=torque).rounded().write_ros(file)
    else:
        write_table(
            file, {"t": time} | _numbered("q", q) | _numbered("dq", dq) | _torque_columns(model, torque)
        )


def _require_free(checker: CollisionChecker, plan: MultisinePlan) -> None:
    """Raise `InputError` where the robot touches itself, the floor or an obstacle within the reference motion."""
    moved = plan.reference_amplitude * np.isin(np.arange(plan.joint_count), plan.joints)
    for pose, q in enumerate(plan.poses, start=1):
        for place in q + np.array([[0.0], [1.0], [-1.0]]) * moved:
            if pairs := checker.colliding(place):
                raise InputError(
                    "E-EXP-023",
                    f"in pose {pose} of the plan, {pairs[0][0]} and {pairs[0][1]} touch or are nearer than {1e3 * checker.margin:g} mm, so "
                    "nothing is written; give another pose, or correct the collision shapes.",
                )


def _leaves_box(model: RobotModel, q: np.ndarray) -> bool:
    """Whether the first point of the resting arm is outside of the box of robot.yaml at one of the positions (N, n)."""
    limits = MotionLimits.of(model)
    if not limits.cartesian:
        return False
    place = tool_at_rest(model, q, None, np.repeat(next(iter(model.points)), len(q))).kinematics.position
    return bool(((place < limits.box[0]) | (place > limits.box[1])).any())


def _label(signal: PlayedSignal) -> RecordingLabel:
    return RecordingLabel(signal.pose, signal.realisation, signal.experiment, signal.sign)


def _torque_columns(model: RobotModel, torque: np.ndarray | None) -> dict[str, np.ndarray]:
    """Torques (N, n), and currents where robot.yaml has the gains; nothing without torques."""
    if torque is None:
        return {}
    columns = _numbered("tau", torque)
    declared = model.config.signals.get("tau")
    if declared is not None and declared.gain is not None and declared.unit in (None, "A", "mA"):
        mapped = mapped_signals(model)["tau"]
        unit = UNITS["tau"][declared.unit or "A"]
        currents = mapped.columns_of(torque + mapped.offset)
        columns |= {f"i{k}": _rounded(unit * values) for k, values in enumerate(currents.values(), start=1)}
    return columns


def _numbered(quantity: str, values: np.ndarray) -> dict[str, np.ndarray]:
    names = standard_columns(quantity, values.shape[1])
    return {name: _rounded(values[:, j]) for j, name in enumerate(names)}


def _rounded(values: np.ndarray) -> np.ndarray:
    """Values with nine significant digits of the largest, as short texts; 0.0 for -0.0."""
    largest = float(np.abs(values).max())
    return np.round(values, _DIGITS - ceil(log10(largest))) + 0.0 if largest > 0 else np.zeros_like(values)


def _row(schedule: PlayedSchedule, signal: PlayedSignal, name: str, whole: bool) -> dict[str, Any]:
    plan = schedule.plan
    loop = schedule.main if whole else schedule.loop
    return {
        "file": name,
        "pose": signal.pose + 1,
        "realisation": signal.realisation + 1,
        "experiment": signal.experiment + 1,
        "sign": signal.sign,
        "rate_hz": plan.rate_hz,
        "start_s": signal.start,
        "period_s": 1 / plan.base_frequency_hz,
        "periods": plan.periods - plan.settle_periods,
        "loop_start_row": schedule.ramp,
        "loop_rows": loop,
        "play_rows": schedule.main,
        "play_s": schedule.samples / plan.rate_hz,
    }


def _as_columns(rows: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def _phases(plan: MultisinePlan) -> dict[str, np.ndarray]:
    """Amplitude and phase of every line, of the experiments with sign +1."""
    spectra = np.array([multisine_spectra(plan, realisation) for realisation in range(plan.realisations)])
    realisation, line, axis, experiment = (index.ravel() for index in np.indices(spectra.shape))
    phasors = spectra.ravel()
    return {
        "realisation": realisation + 1,
        "experiment": experiment + 1,
        "joint": np.array(plan.joints)[axis] + 1,
        "line": plan.lines[line],
        "frequency_hz": plan.frequencies_hz[line],
        "amplitude": np.abs(phasors),
        "phase_rad": np.angle(phasors),
    }


def _moves(model: RobotModel, plan: MultisinePlan) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Time (N,), position and velocity (N, n) from each pose to the next, straight in the joints, at a tenth of their velocity limits."""
    limits = np.array([joint.velocity for joint in model.motor_joints])
    fastest = np.where((limits > 0) & np.isfinite(limits), _MOVE_SHARE * limits, _MOVE_RATE)
    for start, end in zip(plan.poses[:-1], plan.poses[1:], strict=True):
        duration = 1.875 * float((np.abs(end - start) / fastest).max())  # peak of the polynomial's rate
        samples = max(2, ceil(duration * plan.rate_hz) + 1)
        time = np.arange(samples) / plan.rate_hz
        u = (time / time[-1])[:, None]
        share, rate = 10 * u**3 - 15 * u**4 + 6 * u**5, 30 * u**2 * (1 - u) ** 2 / time[-1]
        yield time, start + share * (end - start), rate * (end - start)


def _remarks(schedule: PlayedSchedule, whole: bool) -> list[str]:
    if schedule.period is not None or whole:
        return []
    plan = schedule.plan
    samples = plan.rate_hz / plan.base_frequency_hz
    near = [plan.base_frequency_hz * count for count in (ceil(samples) - 1, ceil(samples))]
    return [
        f"a period of {1 / plan.base_frequency_hz:.6g} s is {samples:.6g} samples at {plan.rate_hz:g} Hz, no whole number: every sample is "
        f"that of the plan's multisine, but the files hold all {plan.periods} periods in place of one, and a recording is resampled; at "
        f"{near[0]:.9g} or {near[1]:.9g} Hz both would be spared",
    ]
