"""The frequency responses that the model predicts in every measured pose, and their derivatives by all parameters of stage 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.data import MultisinePlan
from flexcal.elasticity.drive_torque import DriveTorque
from flexcal.elasticity.naming import half_gap_name, hardening_name, pose_labels, viscous_name
from flexcal.estimation import Parameters
from flexcal.frequency import FrequencyResponse
from flexcal.model import RobotModel
from flexcal.model.linearisation import linearise
from flexcal.model.transfer import transfer_matrix


@dataclass(frozen=True, eq=False)
class Prediction:
    """G (lines, E, E) in one pose, and ∂G (lines, E, E, c) by the parameters numbered `columns` (c,), in estimation coordinates."""

    response: np.ndarray
    derivatives: np.ndarray
    columns: np.ndarray


@dataclass(frozen=True, eq=False)
class PoseModel:
    """One pose: lines (L,), where to linearise, and which parameter is which number of the robot.

    `robot_names` maps names of the robot's own values to parameter numbers. `gaps` maps the axes with backlash to the numbers of their
    half gaps; `gap_compliance` (phases, E) is the relative compliance that each adds along the reference motion, per rad. `hardening` and
    `hardening_stiffness` (phases, E) are the same for drives that harden: relative stiffness, per unit of hardening. `delays` (E,)
    are the numbers of the axes' delays, -1 where there is none; `payload` is the nominal payload mass in kg, None for the declared.
    """

    frequencies_hz: np.ndarray
    q: np.ndarray
    payload: float | None
    robot_names: dict[str, int]
    gaps: dict[int, int]
    gap_compliance: np.ndarray
    hardening: dict[int, int]
    hardening_stiffness: np.ndarray
    delays: np.ndarray

    def values(self, robot: RobotModel, natural: np.ndarray) -> tuple[dict[str, float], float | None]:
        """The robot's own values and the payload (kg) in this pose for the parameters' natural values (p,)."""
        known = {name: float(natural[number]) for name, number in self.robot_names.items()}
        kept = self.stiffness_ratio(natural).mean(axis=0)
        for axis in self.changing:
            for name in _drive(robot, axis):
                known[name] = known.get(name, robot.value(name)) * float(kept[axis])
        payload = self.payload
        if payload is not None and payload > 0 and "payload.mass" in known:
            payload *= known["payload.mass"] / float(robot.payload_mass[0])
            known["payload.mass"] = payload
        return known, payload

    @property
    def changing(self) -> tuple[int, ...]:
        """The axes whose drive changes its stiffness along the reference motion."""
        return tuple(sorted({*self.gaps, *self.hardening}))

    def stiffness_ratio(self, natural: np.ndarray) -> np.ndarray:
        """Stiffness and damping (phases, E) of every drive along the reference motion over those at no load with its gap closed."""
        return self._harder(natural) / self._softer(natural)

    def slopes(self, natural: np.ndarray) -> list[tuple[int, int, float]]:
        """Axis, parameter number, and derivative of the logarithm of the drive's mean stiffness and damping by it: gaps, hardening."""
        harder, softer = self._harder(natural), self._softer(natural)
        mean = np.mean(harder / softer, axis=0)
        by_gap = -np.mean(harder * self.gap_compliance / softer**2, axis=0) / mean
        by_hardening = np.mean(self.hardening_stiffness / softer, axis=0) / mean
        return [
            (axis, number, float(slope[axis]))
            for numbers, slope in ((self.gaps, by_gap), (self.hardening, by_hardening))
            for axis, number in numbers.items()
        ]

    def _softer(self, natural: np.ndarray) -> np.ndarray:
        return 1.0 + self.gap_compliance * _by_axis(self.gaps, natural, self.gap_compliance.shape[1])

    def _harder(self, natural: np.ndarray) -> np.ndarray:
        axes = self.hardening_stiffness.shape[1]
        return 1.0 + self.hardening_stiffness * _by_axis(self.hardening, natural, axes)


@dataclass(frozen=True, eq=False)
class ResponseModel:
    """Predicts every pose at estimation coordinates x (p,); what `parameters` do not hold stays at the value of `robot`.

    The linearisation point is the measured mean motor position; the rest position of the arm follows the parameters. The delay of
    an axis acts on its torque: column j of G is multiplied by exp(-jω τ_j). Gaps count as closed and drives as linear until
    `with_loaded_drives`.
    """

    robot: RobotModel
    parameters: Parameters
    poses: tuple[PoseModel, ...]

    @classmethod
    def of(
        cls, robot: RobotModel, responses: Sequence[FrequencyResponse], parameters: Parameters
    ) -> ResponseModel:
        """For the poses and lines of measured responses; hardening is a parameter's or none."""
        robot = replace(robot, hardening=np.zeros(robot.n))
        labels = pose_labels(responses)
        own = {
            viscous_name(joint.name, label): (f"{joint.name}.viscous", label)
            for joint in robot.driven
            for label in labels
        }
        gaps = {
            axis: parameters.index(half_gap_name(joint.name))
            for axis, joint in enumerate(robot.driven)
            if half_gap_name(joint.name) in parameters
        }
        hardening = {
            axis: parameters.index(hardening_name(joint.name))
            for axis, joint in enumerate(robot.driven)
            if hardening_name(joint.name) in parameters
        }
        poses, unchanged = [], np.zeros((1, len(robot.driven)))
        for response, label in zip(responses, labels, strict=True):
            names: dict[str, int] = {}
            for number, name in enumerate(parameters.names):
                target, only = own.get(name, (name, label))
                if only == label and target in robot.values and not name.endswith((".delay", ".hardening")):
                    names[target] = number
            if response.payload == 0:
                names.pop("payload.mass", None)
            delays = [f"{joint.name}.delay" for joint in robot.driven]
            at = np.array([parameters.index(d) if d in parameters else -1 for d in delays])
            poses.append(
                PoseModel(
                    response.frequencies_hz,
                    response.q_mean,
                    response.payload,
                    names,
                    gaps,
                    unchanged,
                    hardening,
                    unchanged,
                    at,
                )
            )
        return cls(robot, parameters, tuple(poses))

    def with_loaded_drives(self, x: np.ndarray, plan: MultisinePlan) -> ResponseModel:
        """Gaps stand open and drives harden as the plan's torques have it at the coordinates x (p,)."""
        natural = self.parameters.natural(x)
        poses = []
        for pose in self.poses:
            known, payload = pose.values(self.robot, natural)
            loaded = DriveTorque.of(self.robot.with_values(known), pose.q, payload, plan)
            mean = pose.stiffness_ratio(natural).mean(axis=0)
            loaded = replace(loaded, stiffness=loaded.stiffness / mean)  # at no load
            hardening = _by_axis(pose.hardening, natural, len(mean))
            poses.append(
                replace(
                    pose,
                    gap_compliance=loaded.gap_compliance(),
                    hardening_stiffness=loaded.hardening_stiffness(hardening),
                )
            )
        return replace(self, poses=tuple(poses))

    def predict(self, x: np.ndarray) -> list[Prediction]:
        """Responses and derivatives of every pose."""
        values, slopes = self.parameters.natural(x), self.parameters.natural_slope(x)
        return [self._pose(pose, values, slopes, derivatives=True) for pose in self.poses]

    def responses(self, x: np.ndarray) -> list[np.ndarray]:
        """Responses (lines, E, E) of every pose, without derivatives."""
        values, slopes = self.parameters.natural(x), self.parameters.natural_slope(x)
        return [self._pose(pose, values, slopes, derivatives=False).response for pose in self.poses]

    def _pose(
        self, pose: PoseModel, values: np.ndarray, slopes: np.ndarray, *, derivatives: bool
    ) -> Prediction:
        known, payload = pose.values(self.robot, values)
        robot = self.robot.with_values(known)
        softened = {name: axis for axis in pose.changing for name in _drive(robot, axis)}
        names = tuple(dict.fromkeys((*pose.robot_names, *softened))) if derivatives else ()
        system = linearise(robot, pose.q, payload, derivatives=names)
        s = 2j * np.pi * pose.frequencies_hz
        moved = transfer_matrix(system, pose.frequencies_hz)
        response, change = moved.response, moved.derivatives
        late = np.array([values[number] if number >= 0 else 0.0 for number in pose.delays])
        phase = np.exp(-s[:, None] * late)[:, None, :]
        response = response * phase
        if not derivatives:
            return Prediction(response, np.empty((*response.shape, 0)), np.empty(0, dtype=int))
        change = change * phase[..., None]
        drive_changes = {axis: np.zeros_like(response) for axis in pose.changing}
        numbers, blocks = [], []
        for k, name in enumerate(names):
            slope = known[name]  # ∂/∂ log of it
            if name in pose.robot_names:
                numbers.append(pose.robot_names[name])
                log = self.parameters[numbers[-1]].scale == "log"
                blocks.append(change[..., k] * (slope if log else 1.0))
            if name in softened:
                drive_changes[softened[name]] += change[..., k] * slope
        for axis, number, by_parameter in pose.slopes(values):
            numbers.append(number)
            blocks.append(drive_changes[axis] * by_parameter)
        for axis in np.flatnonzero(pose.delays >= 0):
            numbers.append(pose.delays[axis])
            late = np.zeros_like(response)
            late[:, :, axis] = -s[:, None] * response[:, :, axis] * slopes[numbers[-1]]
            blocks.append(late)
        return Prediction(response, np.stack(blocks, axis=-1), np.array(numbers))


def _by_axis(numbers: dict[int, int], natural: np.ndarray, axes: int) -> np.ndarray:
    """Natural values (axes,) of one parameter an axis, 0 where an axis has none."""
    values = np.zeros(axes)
    values[list(numbers)] = natural[list(numbers.values())]
    return values


def _drive(robot: RobotModel, axis: int) -> tuple[str, str]:
    drive = f"{robot.driven[axis].name}.drive"
    return f"{drive}.stiffness", f"{drive}.damping"
