"""The frequency responses that the model predicts in every measured pose, and their derivatives by all parameters of stage 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.elasticity.naming import pose_labels, softening_name, viscous_name
from flexcal.estimation import Parameters
from flexcal.frequency import FrequencyResponse
from flexcal.model import RobotModel
from flexcal.model.linearisation import Linearisation, linearise


@dataclass(frozen=True, eq=False)
class Prediction:
    """G (lines, E, E) in one pose, and ∂G (lines, E, E, c) by the parameters numbered `columns` (c,), in estimation coordinates."""

    response: np.ndarray
    derivatives: np.ndarray
    columns: np.ndarray


@dataclass(frozen=True, eq=False)
class PoseModel:
    """One pose: lines (L,), where to linearise, and which parameter is which number of the robot.

    `robot_names` maps names of the robot's own values to parameter numbers, `softening` the names of drive stiffnesses to the
    numbers of their softening in this pose; `delays` (E,) are the numbers of the axes' delays, -1 where there is none; `payload`
    is the nominal payload mass in kg, None for the declared one.
    """

    frequencies_hz: np.ndarray
    q: np.ndarray
    payload: float | None
    robot_names: dict[str, int]
    softening: dict[str, int]
    delays: np.ndarray

    def values(self, robot: RobotModel, natural: np.ndarray) -> tuple[dict[str, float], float | None]:
        """The robot's own values and the payload (kg) in this pose for the parameters' natural values (p,)."""
        known = {name: float(natural[number]) for name, number in self.robot_names.items()}
        for name, number in self.softening.items():
            known[name] = known.get(name, robot.value(name)) * float(np.exp(-natural[number]))
        payload = self.payload
        if payload is not None and payload > 0 and "payload.mass" in known:
            payload *= known["payload.mass"] / float(robot.payload_mass[0])
            known["payload.mass"] = payload
        return known, payload


@dataclass(frozen=True, eq=False)
class ResponseModel:
    """Predicts every pose at estimation coordinates x (p,); what `parameters` do not hold stays at the value of `robot`.

    The linearisation point is the measured mean motor position; the rest position of the arm follows the parameters. The delay of
    an axis acts on its torque: column j of G is multiplied by exp(-jω τ_j).
    """

    robot: RobotModel
    parameters: Parameters
    poses: tuple[PoseModel, ...]

    @classmethod
    def of(
        cls, robot: RobotModel, responses: Sequence[FrequencyResponse], parameters: Parameters
    ) -> ResponseModel:
        """For the poses and lines of measured responses."""
        labels = pose_labels(responses)
        own = {
            viscous_name(joint.name, label): (f"{joint.name}.viscous", label)
            for joint in robot.elastic
            for label in labels
        }
        poses = []
        for response, label in zip(responses, labels, strict=True):
            soft = {
                f"{joint.name}.drive.stiffness": parameters.index(softening_name(joint.name, label))
                for joint in robot.elastic
                if softening_name(joint.name, label) in parameters
            }
            names: dict[str, int] = {}
            for number, name in enumerate(parameters.names):
                target, only = own.get(name, (name, label))
                if only == label and target in robot.values and not name.endswith(".delay"):
                    names[target] = number
            if response.payload == 0:
                names.pop("payload.mass", None)
            delays = [f"{joint.name}.delay" for joint in robot.elastic]
            at = np.array([parameters.index(d) if d in parameters else -1 for d in delays])
            poses.append(
                PoseModel(response.frequencies_hz, response.q_mean, response.payload, names, soft, at)
            )
        return cls(robot, parameters, tuple(poses))

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
        names = tuple(dict.fromkeys((*pose.robot_names, *pose.softening))) if derivatives else ()
        system = linearise(robot, pose.q, payload, derivatives=names)
        s = 2j * np.pi * pose.frequencies_hz
        response, change = batch_transfer(system, names, s)
        late = np.array([values[number] if number >= 0 else 0.0 for number in pose.delays])
        phase = np.exp(-s[:, None] * late)[:, None, :]
        response = response * phase
        if not derivatives:
            return Prediction(response, np.empty((*response.shape, 0)), np.empty(0, dtype=int))
        change *= phase[..., None]
        numbers, blocks = [], []
        for k, name in enumerate(names):
            slope = known[name]  # ∂/∂ log of it
            if name in pose.robot_names:
                numbers.append(pose.robot_names[name])
                log = self.parameters[numbers[-1]].scale == "log"
                blocks.append(change[..., k] * (slope if log else 1.0))
            if name in pose.softening:
                numbers.append(pose.softening[name])
                blocks.append(change[..., k] * (-slope * slopes[numbers[-1]]))
        for axis in np.flatnonzero(pose.delays >= 0):
            numbers.append(pose.delays[axis])
            late = np.zeros_like(response)
            late[:, :, axis] = -s[:, None] * response[:, :, axis] * slopes[numbers[-1]]
            blocks.append(late)
        return Prediction(response, np.stack(blocks, axis=-1), np.array(numbers))


def batch_transfer(
    system: Linearisation, names: Sequence[str], s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """G (L, E, E) at s (L,) rad/s, and its derivatives (L, E, E, c) by `names`, as `transfer_matrix` but all in three products.

    With X = A⁻¹B, ∂G_ij = -s² Σ_ab X_ai X_bj (s² ∂M + s ∂D + ∂K)_ab. The products X X for a ≤ b and i ≤ j are formed once (both
    are symmetric), and multiply each kind's derivatives, stacked, in one real matrix product.
    """
    count, size = system.inputs, len(system.mass)
    at = s[:, None, None]
    forces = np.broadcast_to(np.eye(size, count), (len(s), size, count))
    moved = np.linalg.solve(at**2 * system.mass + at * system.damping + system.stiffness, forces)
    response = at**2 * moved[:, :count]
    if not names:
        return response, np.empty((*response.shape, 0), dtype=complex)
    parts = [np.array(kind) for kind in zip(*(system.derivatives[name] for name in names), strict=True)]
    used = np.logical_or.reduce([np.any(part != 0, axis=0) for part in parts])
    a, b = np.nonzero(np.triu(used))
    i, j = np.triu_indices(count)
    pairs = moved[:, a][:, :, i] * moved[:, b][:, :, j] + moved[:, b][:, :, i] * moved[:, a][:, :, j]
    pairs *= np.where(a == b, 0.5, 1.0)[:, None]
    table = np.ascontiguousarray(np.moveaxis(pairs, 1, 2)).reshape(-1, len(a))
    table = np.vstack([table.real, table.imag])
    upper = np.zeros((len(s), len(i), len(names)), dtype=complex)
    for power, part in zip((4, 3, 2), parts, strict=True):
        some = np.flatnonzero(np.any(part != 0, axis=(1, 2)))
        product = table @ part[some][:, a, b].T
        half = len(product) // 2
        product = (product[:half] + 1j * product[half:]).reshape(len(s), len(i), len(some))
        upper[:, :, some] -= s[:, None, None] ** power * product
    change = np.empty((*response.shape, len(names)), dtype=complex)
    change[:, i, j] = upper
    change[:, j, i] = upper
    return response, change
