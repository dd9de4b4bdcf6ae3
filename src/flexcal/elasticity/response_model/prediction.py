"""Predicted frequency responses in every measured pose, and their derivatives by all parameters of stage 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.response_model.parameter_names import (
    backlash_name,
    hardening_name,
    pose_labels,
    slip_share_name,
    slip_twist_name,
    viscous_name,
)
from flexcal.elasticity.time_periodic import DriveTorque, HardenedStiffness, SlippingSprings
from flexcal.estimation import Parameters
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import (
    DRIVE_GAIN,
    ArmSensor,
    RobotModel,
    mounting_names,
    sensitivity_name,
    sensor_delay_name,
)
from flexcal.model.vibration import ElasticArm, drive_stretch, linearise, transfer_matrix

_MOUNTING_STEP = 1e-6
"""Step, m or rad, of the difference quotients by mounting errors, in which readings are linear but for the length of the direction."""


@dataclass(frozen=True, eq=False)
class PredictedMeasurements:
    """Response G (lines, E + S, E) in one pose, and ∂G (lines, E + S, E, c) by the parameters numbered `columns` (c,), in estimation
    coordinates.
    """

    response: np.ndarray
    derivatives: np.ndarray
    columns: np.ndarray


@dataclass(frozen=True, eq=False)
class DriveChange:
    """Effective `stiffness` N m/rad and `damping` N m s/rad of a drive in one pose, on the mean over the reference motion, and the
    derivatives of both by the parameters that change them, in estimation coordinates.
    """

    stiffness: float
    damping: float
    derivatives: dict[int, np.ndarray]

    def with_spring(
        self,
        stiffness: float,
        gains: np.ndarray,
        slopes: np.ndarray,
        share: int,
        twist: int,
        drive: int | None,
    ) -> DriveChange:
        """The drive with a slipping spring of `stiffness` N m/rad and `gains` (2,), of `slopes` (2,) by the logarithm of the torque at
        which it slips; numbers of its `share` and `twist`, and of the stiffness of the `drive`, all logarithms.
        """
        added = stiffness * gains
        by = self.derivatives | {share: added, twist: stiffness * slopes}
        if drive is not None:
            by[drive] = by[drive] + added + by[twist]
        return DriveChange(self.stiffness + float(added[0]), self.damping + float(added[1]), by)


@dataclass(frozen=True, eq=False)
class PoseModel:
    """Model of one pose: lines (L,), rest position, and the mapping of parameter numbers to the robot's.

    `robot_names` maps names of the robot's own values to parameter numbers. `backlash` maps the axes with backlash to the numbers of
    their half gaps; `backlash_compliance` (phases, E) is the relative compliance that each adds along the reference motion, per rad.
    `hardening` maps the axes whose drives harden under their `torque` to their numbers; `slip` maps the joints with a spring that slips
    to the numbers of its share and twist, `slipping` are its gains under the torques of drives of `linear` stiffness (E,). `delays` and
    `gains` (E,) are the numbers of the axes' delays and drive gains, -1 where there is none; `payload` is the nominal payload mass in kg,
    None for the declared. `sensors` (S) on the arm have their sensitivities and delays at `sensitivities` and `late` (S,), and their
    errors of mounting at `mounting` (S, 5), -1 where there is none.
    """

    frequencies_hz: np.ndarray
    q: np.ndarray
    payload: float | None
    robot_names: dict[str, int]
    backlash: dict[int, int]
    backlash_compliance: np.ndarray
    hardening: dict[int, int]
    torque: DriveTorque | None
    slip: dict[str, tuple[int, int]]
    slipping: SlippingSprings | None
    linear: np.ndarray
    delays: np.ndarray
    gains: np.ndarray
    sensors: tuple[ArmSensor, ...]
    sensitivities: np.ndarray
    late: np.ndarray
    mounting: np.ndarray

    def placed(self, natural: np.ndarray) -> tuple[ArmSensor, ...]:
        """Sensors on the arm as mounted."""
        errors = self.mounting_errors(natural)
        return tuple(sensor.misplaced(e) for sensor, e in zip(self.sensors, errors, strict=True))

    def mounting_errors(self, natural: np.ndarray) -> np.ndarray:
        """Errors of mounting (S, 5) in m and rad."""
        return np.where(self.mounting >= 0, natural[self.mounting], 0.0)

    def measured(self, natural: np.ndarray) -> np.ndarray:
        """Measurement factor (L, E + S, E) of G: gains and delays of torques, delays and sensitivities of readings."""
        s = 2j * np.pi * self.frequencies_hz[:, None]
        gain = np.array([natural[number] if number >= 0 else 1.0 for number in self.gains])
        torque = np.array([natural[number] if number >= 0 else 0.0 for number in self.delays])
        ones = np.ones((len(s), len(torque)))
        rows = np.concatenate([ones, natural[self.sensitivities] * np.exp(-s * natural[self.late])], axis=1)
        return rows[:, :, None] * (gain * np.exp(-s * torque))[:, None, :]

    def values(self, robot: RobotModel, natural: np.ndarray) -> tuple[dict[str, float], float | None]:
        """Values of the robot and payload (kg) in this pose for natural parameter values (p,)."""
        known = {name: float(natural[number]) for name, number in self.robot_names.items()}
        for joint, change in self.drives(robot, natural).items():
            stiffness, damping = _drive(joint)
            known |= {stiffness: change.stiffness, damping: change.damping}
        payload = self.payload
        if payload is not None and payload > 0 and "payload.mass" in known:
            payload *= known["payload.mass"] / robot.payload_mass
            known["payload.mass"] = payload
        return known, payload

    def opening(self, robot: RobotModel, natural: np.ndarray) -> np.ndarray:
        """Shares (2, phases, E) of every drive's effective stiffness and damping that gap, hardening and slip take away along the
        reference motion, with mean 0.
        """
        ratio = self._ratio(robot, natural)
        missing = ratio.mean(axis=1, keepdims=True) - ratio
        drives = self.drives(robot, natural)
        for axis, joint in enumerate(robot.driven):
            if joint.name not in drives:
                continue
            k, d = at_no_load = np.array(self.at_no_load(robot, natural, joint.name))
            if self.slipping is not None:
                share, limits = self._slip(robot, natural)
                number = list(self.slip).index(joint.name)
                course = self.slipping.course(limits, ratio.shape[1])[..., number]
                missing[..., axis] -= share[number] * course * np.array([[1.0], [k / d]])
            effective = [drives[joint.name].stiffness, drives[joint.name].damping]
            missing[..., axis] *= (at_no_load / effective)[:, None]
        return missing

    def _ratio(self, robot: RobotModel, natural: np.ndarray) -> np.ndarray:
        """Stiffness and damping (2, phases, E) of every drive along the reference motion relative to those at no load with closed gap:
        an open gap has neither, and hardening leaves the damping as it is.
        """
        hardened = self._hardened(robot, natural).ratio
        return np.stack([hardened, np.ones_like(hardened)]) / self._softer(natural)

    def drives(self, robot: RobotModel, natural: np.ndarray) -> dict[str, DriveChange]:
        """Effect of gap, hardening and slip on the drives that have one of them, by joint."""
        hardened, softer, ratio = (
            self._hardened(robot, natural),
            self._softer(natural),
            self._ratio(robot, natural),
        )
        mean, by_gap = ratio.mean(axis=1), -np.mean(ratio * self.backlash_compliance / softer, axis=1)
        by_hardening, by_stiffness = (
            np.stack([np.mean(slope / softer, axis=0), np.zeros(softer.shape[1])])
            for slope in (hardened.by_hardening, hardened.by_stiffness)
        )
        changes: dict[str, DriveChange] = {}
        for axis, joint in enumerate(robot.driven):
            k, d = both = np.array(self.at_no_load(robot, natural, joint.name))
            by: dict[int, np.ndarray] = {}
            if axis in self.backlash:
                by[self.backlash[axis]] = both * by_gap[:, axis]
            if axis in self.hardening:
                by[self.hardening[axis]] = both * by_hardening[:, axis]
            if not by:
                continue
            own = (both * by_stiffness[:, axis] + [k * mean[0, axis], 0.0], [0.0, d * mean[1, axis]])
            changes[joint.name] = self._changed(joint.name, both * mean[:, axis], by, own)
        if self.slipping is not None:
            gains, slopes = self.slipping.mean(self._slip(robot, natural)[1])
            for column, (joint, (share, twist)) in enumerate(self.slip.items()):
                k, d = both = np.array(self.at_no_load(robot, natural, joint))
                without = changes.get(joint) or self._changed(joint, both, {}, ([k, 0.0], [0.0, d]))
                changes[joint] = without.with_spring(
                    k * natural[share],
                    gains[:, column],
                    slopes[:, column],
                    share,
                    twist,
                    self.robot_names.get(_drive(joint)[0]),
                )
        return changes

    def _changed(
        self, joint: str, effective: np.ndarray, by: dict[int, np.ndarray], own: Sequence[ArrayLike]
    ) -> DriveChange:
        """A drive of `effective` stiffness and damping, with derivatives `by` further parameters and by those of its `own`."""
        for name, slope in zip(_drive(joint), own, strict=True):
            if name in self.robot_names:
                by[self.robot_names[name]] = np.array(slope)
        return DriveChange(float(effective[0]), float(effective[1]), by)

    def at_no_load(self, robot: RobotModel, natural: np.ndarray, joint: str) -> tuple[float, float]:
        """Stiffness and damping of a drive at no load, with closed gap and without slip."""
        stiffness, damping = (
            float(natural[self.robot_names[name]]) if name in self.robot_names else robot.value(name)
            for name in _drive(joint)
        )
        return stiffness, damping

    def _slip(self, robot: RobotModel, natural: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Shares (E,) of the slipping springs, and the twists (E,) rad of drives of `linear` stiffness at whose torque they slip: what a
        spring carries is known better than its stiffness.
        """
        share, twist = natural[list(self.slip.values())].T
        stiffness = np.array([self.at_no_load(robot, natural, joint)[0] for joint in self.slip])
        return share, twist * stiffness / self.linear

    def uneven_slip(
        self, robot: RobotModel, natural: np.ndarray
    ) -> tuple[np.ndarray, dict[str, dict[int, np.ndarray]]]:
        """Complex stiffness (L, D) N m/rad at the lines of the slipping springs of all elastic drives beyond their mean stiffness and
        damping; by joint its derivatives (L,) by the parameters that change it, in estimation coordinates. Without such springs D is 0.
        """
        if self.slipping is None:
            return np.zeros((len(self.frequencies_hz), 0)), {}
        share, limits = self._slip(robot, natural)
        stiffness = [self.at_no_load(robot, natural, joint)[0] for joint in self.slip]
        added, slopes = (share * stiffness * gain for gain in self.slipping.at(limits, self.frequencies_hz))
        by = {
            joint: {of: a, twist: b}
            for (joint, (of, twist)), a, b in zip(self.slip.items(), added.T, slopes.T, strict=True)
        }
        for joint, (of, twist) in self.slip.items():
            if (drive := self.robot_names.get(_drive(joint)[0])) is not None:
                by[joint][drive] = by[joint][of] + by[joint][twist]
        return added, by

    def _softer(self, natural: np.ndarray) -> np.ndarray:
        half_width = np.zeros(self.backlash_compliance.shape[1])
        half_width[list(self.backlash)] = natural[list(self.backlash.values())]
        return 1.0 + self.backlash_compliance * half_width

    def _hardened(self, robot: RobotModel, natural: np.ndarray) -> HardenedStiffness:
        """Whether the drives harden, all or none."""
        if self.torque is None or not self.hardening:
            none = np.zeros_like(self.backlash_compliance)
            return HardenedStiffness(none + 1.0, none, none)
        axes = sorted(self.hardening)
        stiffness = np.array([self.at_no_load(robot, natural, robot.driven[axis].name)[0] for axis in axes])
        return self.torque.hardened(stiffness, natural[[self.hardening[axis] for axis in axes]])


@dataclass(frozen=True, eq=False)
class ResponseModel:
    """Predictor of every pose at estimation coordinates x (p,); values that are not `parameters` are those of `robot`.

    The linearisation point is the measured mean motor position; the rest position of the arm follows the parameters. The delay of an axis
    acts on its torque: column j of G is multiplied by exp(-jω τ_j), and by its drive gain. Gaps count as closed and drives as linear until
    `with_loaded_drives`.
    """

    robot: RobotModel
    parameters: Parameters
    poses: tuple[PoseModel, ...]

    @classmethod
    def of(
        cls, robot: RobotModel, responses: Sequence[FrequencyResponse], parameters: Parameters
    ) -> ResponseModel:
        """Model for the poses and lines of measured responses, with or without hardening as parameters."""
        robot = replace(robot, springs=replace(robot.springs, hardening=np.zeros(robot.n)))
        labels = pose_labels(responses)
        own = {
            viscous_name(joint.name, label): (f"{joint.name}.viscous", label)
            for joint in robot.driven
            for label in labels
        }
        backlash = {
            axis: parameters.index(backlash_name(joint.name))
            for axis, joint in enumerate(robot.driven)
            if backlash_name(joint.name) in parameters
        }
        hardening = {
            axis: parameters.index(hardening_name(joint.name))
            for axis, joint in enumerate(robot.driven)
            if hardening_name(joint.name) in parameters
        }
        slip = {
            e.name: (
                parameters.index(slip_share_name(e.name)),
                parameters.index(slip_twist_name(e.name)),
            )
            for e in robot.elastic
            if slip_share_name(e.name) in parameters
        }

        def number(name: str) -> int:
            return parameters.index(name) if name in parameters else -1

        poses = []
        for response, label in zip(responses, labels, strict=True):
            names: dict[str, int] = {}
            for k, name in enumerate(parameters.names):
                target, only = own.get(name, (name, label))
                if (
                    only == label
                    and target in robot.values
                    and not name.endswith((".delay", ".hardening", f".{DRIVE_GAIN}"))
                ):
                    names[target] = k
            if response.payload == 0:
                names.pop("payload.mass", None)
            delays = [f"{joint.name}.delay" for joint in robot.driven]
            at = np.array([number(name) for name in delays])
            gains = np.array([number(f"{joint.name}.{DRIVE_GAIN}") for joint in robot.driven])
            sensors = tuple(robot.sensors[name] for name in response.sensors)
            poses.append(
                PoseModel(
                    response.frequencies_hz,
                    response.q_mean,
                    response.payload,
                    names,
                    backlash,
                    np.zeros((1, len(robot.driven))),
                    hardening,
                    None,
                    slip,
                    None,
                    np.zeros(0),
                    at,
                    gains,
                    sensors,
                    np.array([parameters.index(sensitivity_name(s.name)) for s in sensors], dtype=int),
                    np.array([parameters.index(sensor_delay_name(s.name)) for s in sensors], dtype=int),
                    np.array(
                        [[number(name) for name in mounting_names(s.name)] for s in sensors], dtype=int
                    ).reshape(-1, 5),
                )
            )
        return cls(robot, parameters, tuple(poses))

    def with_loaded_drives(self, x: np.ndarray, plan: MultisinePlan) -> ResponseModel:
        """Model with gaps and hardening under the plan's torques at the coordinates x (p,)."""
        natural = self.parameters.natural(x)
        poses = []
        for pose in self.poses:
            known, payload = pose.values(self.robot, natural)
            loaded = DriveTorque.of(self.robot.with_values(known), pose.q, payload, plan)
            still = [pose.at_no_load(self.robot, natural, joint.name)[0] for joint in self.robot.driven]
            loaded = replace(loaded, stiffness=np.array(still))
            slipping, linear = None, pose.linear
            if pose.slip:
                moved = DriveTorque.of(self.robot.with_values(known), pose.q, payload, plan, held=True)
                linear = np.array(
                    [pose.at_no_load(self.robot, natural, e.name)[0] for e in self.robot.elastic]
                )
                slipping = SlippingSprings.of(
                    moved.slow / linear,
                    moved.lines / moved.stiffness,
                    plan.frequencies_hz,
                    plan.reference_frequency_hz or plan.base_frequency_hz,
                )
            compliance = loaded.backlash_compliance()
            poses.append(
                replace(pose, backlash_compliance=compliance, torque=loaded, slipping=slipping, linear=linear)
            )
        return replace(self, poses=tuple(poses))

    def damping_changes(self, x: np.ndarray) -> dict[str, float]:
        """Relative change of the damping of drives, by joint, by slipping springs and open gaps at the coordinates x (p,), on the mean over
        poses."""
        natural, poses = self.parameters.natural(x), len(self.poses)
        changes: dict[str, float] = {}
        for pose in self.poses:
            for joint, drive in pose.drives(self.robot, natural).items():
                own = pose.at_no_load(self.robot, natural, joint)[1]
                changes[joint] = changes.get(joint, 0.0) + (drive.damping / own - 1) / poses
        return changes

    @cached_property
    def _arm(self) -> ElasticArm:
        """Arm of the robot; those of all poses differ in values alone."""
        return ElasticArm(self.robot)

    def predict(self, x: np.ndarray) -> list[PredictedMeasurements]:
        """Responses and derivatives of every pose."""
        values, slopes = self.parameters.natural(x), self.parameters.natural_slope(x)
        return [self._pose(pose, values, slopes, derivatives=True) for pose in self.poses]

    def responses(self, x: np.ndarray) -> list[np.ndarray]:
        """Responses (lines, E + S, E) of every pose, without derivatives."""
        values, slopes = self.parameters.natural(x), self.parameters.natural_slope(x)
        return [self._pose(pose, values, slopes, derivatives=False).response for pose in self.poses]

    def _pose(
        self, pose: PoseModel, values: np.ndarray, slopes: np.ndarray, *, derivatives: bool
    ) -> PredictedMeasurements:
        known, payload = pose.values(self.robot, values)
        robot = self.robot.with_values(known)
        changing = pose.drives(self.robot, values) if derivatives else {}
        drives = [name for joint in changing for name in _drive(joint)]
        names = tuple(dict.fromkeys((*pose.robot_names, *drives))) if derivatives else ()
        sensors = pose.placed(values)
        system = linearise(robot, pose.q, payload, derivatives=names, sensors=sensors, like=self._arm)
        s = 2j * np.pi * pose.frequencies_hz
        uneven, by_slip = pose.uneven_slip(self.robot, values)
        pull = drive_stretch(robot, system, held=True)[:, : uneven.shape[1]]
        moved = transfer_matrix(
            system, pose.frequencies_hz, added=np.einsum("dg,lg,eg->lde", pull, uneven, pull)
        )
        response, change = moved.response, moved.derivatives
        factor = pose.measured(values)
        response = response * factor
        if not derivatives:
            return PredictedMeasurements(response, np.empty((*response.shape, 0)), np.empty(0, dtype=int))
        change = change * factor[..., None]
        blocks: dict[int, np.ndarray] = {}
        for k, name in enumerate(names):
            if name in pose.robot_names:
                number = pose.robot_names[name]
                log = self.parameters[number].scale == "log"
                blocks[number] = change[..., k] * (known[name] if log else 1.0)
        for joint, drive in changing.items():
            by_stiffness, by_damping = (change[..., names.index(name)] for name in _drive(joint))
            for number, (stiffer, damped) in drive.derivatives.items():
                blocks[number] = by_stiffness * stiffer + by_damping * damped
            for number, slope in by_slip.get(joint, {}).items():
                blocks[number] += by_stiffness * slope[:, None, None]
        for axis in np.flatnonzero(pose.delays >= 0):
            number = int(pose.delays[axis])
            blocks[number] = np.zeros_like(response)
            blocks[number][:, :, axis] = -s[:, None] * response[:, :, axis] * slopes[number]
        for axis in np.flatnonzero(pose.gains >= 0):
            number = int(pose.gains[axis])
            blocks[number] = np.zeros_like(response)
            blocks[number][:, :, axis] = response[:, :, axis] * slopes[number] / values[number]
        for row, (sensitivity, late) in enumerate(
            zip(pose.sensitivities, pose.late, strict=True), response.shape[2]
        ):
            blocks[int(sensitivity)], blocks[int(late)] = np.zeros_like(response), np.zeros_like(response)
            blocks[int(sensitivity)][:, row] = response[:, row] * slopes[sensitivity] / values[sensitivity]
            blocks[int(late)][:, row] = -s[:, None] * response[:, row] * slopes[late]
        for row, way in np.argwhere(pose.mounting >= 0):
            errors = pose.mounting_errors(values)[row] + _MOUNTING_STEP * np.eye(5)[way]
            moved = pose.sensors[row].misplaced(errors)
            nearby = transfer_matrix(
                linearise(robot, pose.q, payload, sensors=[moved], like=self._arm), pose.frequencies_hz
            )
            number, at = int(pose.mounting[row, way]), response.shape[2] + row
            blocks[number] = np.zeros_like(response)
            change = nearby.response[:, -1] * factor[:, at] - response[:, at]
            blocks[number][:, at] = change / _MOUNTING_STEP * slopes[number]
        return PredictedMeasurements(
            response, np.stack(list(blocks.values()), axis=-1), np.array(list(blocks))
        )


def _drive(joint: str) -> tuple[str, str]:
    return f"{joint}.drive.stiffness", f"{joint}.drive.damping"
