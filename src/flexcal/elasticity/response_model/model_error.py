"""Covariance of the residual due to model errors: geometric errors, and non-viscous friction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.elasticity.response_model.experiment_effect import ExperimentEffect
from flexcal.elasticity.response_model.parameter_names import pose_labels, viscous_name
from flexcal.elasticity.response_model.prediction import PredictedMeasurements, ResponseModel
from flexcal.elasticity.response_model.residual import ResponseResidual
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import (
    ANGLE_TOLERANCE,
    FRICTION_TOLERANCE,
    GEOMETRY,
    LENGTH_TOLERANCE,
    SHARED_DISTORTION,
    RobotModel,
    uncertain_tensor_entries,
)
from flexcal.model.vibration import (
    KNOT_OCTAVES,
    friction_response_change,
    over_frequency,
    sensitivity_response_change,
)

NEGLIGIBLE = 1e-3
"""Size of a model error, in standard deviations of the measurement, from which it counts: the variance is 1e-6 more."""


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of effects not included in the model.

    `length` (m) and `angle` (rad) of every geometric error, unknown before stage 2; `strength` and `width` of the friction pulses of a
    motor, relative, common to all poses and half as much in each; `friction`: other deviation of a motor's impedance from a viscous
    coefficient, relative to that; `backlash`: deviation of a gap's effect from the softening of its drive, relative to that, and
    `hysteresis` of a slipping spring's from its mean stiffness and damping; these are complex random functions of frequency in every
    pose, with knots every `octave`. `distortion` is the share of the stochastic nonlinear distortion that all realisations have in
    common, for reference motion and friction are the same in all: averaging over realisations does not lower it. With `flatness`,
    sensors on the arm are not flat over frequency, each as its `flatness_std` says: in common in all poses and half as much in each,
    where the reference motion turns them.
    With `inertia`, the links' inertia tensors err by `prior: inertia` of robot.yaml beside their change with the mass.
    """

    length: float = LENGTH_TOLERANCE
    angle: float = ANGLE_TOLERANCE
    strength: float = 0.2
    width: float = 0.3
    friction: float = FRICTION_TOLERANCE
    backlash: float = 0.3
    hysteresis: float = 0.3
    distortion: float = SHARED_DISTORTION
    octave: float = KNOT_OCTAVES
    flatness: bool = True
    inertia: bool = True

    @classmethod
    def none(cls) -> Tolerances:
        """Zero tolerances of an exact model."""
        return cls(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, flatness=False, inertia=False)

    @property
    def any(self) -> bool:
        """Whether any tolerance is nonzero."""
        sizes = (
            self.length,
            self.angle,
            self.strength,
            self.width,
            self.friction,
            self.backlash,
            self.hysteresis,
        )
        return max(sizes) > 0 or self.inertia

    def inflation(self, responses: Sequence[FrequencyResponse]) -> float:
        """Variance inflation of the responses relative to independent realisations."""
        shares = []
        for response in responses:
            distorted = np.mean(response.distortion_std**2) / np.mean(response.std**2)
            shares.append(distorted * (len(response.realisations) - 1))
        return 1.0 + self.distortion * float(np.mean(shares))


@dataclass(frozen=True, eq=False)
class LowRank:
    """Whitening of 1 + B Bᵀ by its thin factor: `basis` (m, k) orthonormal, `shrink` (k,) = 1 - 1/√(1 + s²)."""

    basis: np.ndarray
    shrink: np.ndarray
    log_determinant: float

    @classmethod
    def of(cls, columns: np.ndarray) -> LowRank:
        """Whitening for B (m, k) in whitened rows."""
        factor, triangle = np.linalg.qr(columns)
        turn, size, _ = np.linalg.svd(triangle)
        turn, size = turn[:, size > NEGLIGIBLE], size[size > NEGLIGIBLE]
        return cls(factor @ turn, 1 - 1 / np.sqrt(1 + size**2), float(np.log1p(size**2).sum()))

    def whiten(self, rows: np.ndarray) -> np.ndarray:
        """Product of (1 + B Bᵀ)^(-1/2) and rows (m,) or (m, c)."""
        inner = self.basis.T @ rows
        shrink = self.shrink if rows.ndim == 1 else self.shrink[:, None]
        return rows - self.basis @ (shrink * inner)


@dataclass(frozen=True, eq=False)
class ModelError:
    """Model errors of all poses: independent in each pose (friction), and common to all (geometry)."""

    poses: tuple[LowRank, ...]
    common: LowRank

    @classmethod
    def of(
        cls,
        residual: ResponseResidual,
        responses: Sequence[FrequencyResponse],
        x: np.ndarray,
        effects: Sequence[ExperimentEffect],
        tolerances: Tolerances,
    ) -> ModelError:
        """Model errors to first order about the coordinates x (p,)."""
        model = residual.model
        blocks, columns = [], []
        predictions = model.predict(x)
        shifts = unknown_shifts(model, x, tolerances)
        natural = model.parameters.natural(x)
        values = dict(zip(model.parameters.names, natural, strict=True))
        labels = pose_labels(responses)
        every = tuple(dict.fromkeys(sensor.name for pose in model.poses for sensor in pose.sensors))
        grid = np.concatenate([response.frequencies_hz for response in responses])
        for k, (pose, response, label) in enumerate(zip(residual.poses, responses, labels, strict=True)):
            nominal = predictions[k].response
            viscous = np.array([values[viscous_name(joint, label)] for joint in response.joints])
            change = friction_response_change(
                nominal, response.frequencies_hz, tolerances.friction * viscous, tolerances.octave
            )
            gaps = list(model.poses[k].backlash.values())
            slip = [share for share, _ in model.poses[k].slip.values()]
            number = gaps + slip
            column = [list(predictions[k].columns).index(n) for n in number]
            size = np.append(tolerances.backlash * natural[gaps], np.full(len(slip), tolerances.hysteresis))
            drives = size * predictions[k].derivatives[..., column]
            change = np.concatenate(
                [change, over_frequency(drives, response.frequencies_hz, tolerances.octave)], axis=-1
            )
            none = np.empty(0, dtype=int)
            half = effects[k].by_friction.shape[-1] // 2
            form = effects[k].by_friction * np.repeat([tolerances.strength, tolerances.width], half)
            uneven = np.zeros((*nominal.shape, 0))
            if tolerances.flatness:
                sensors = model.poses[k].sensors
                uneven = sensitivity_response_change(
                    nominal,
                    response.frequencies_hz,
                    sensors,
                    every=every,
                    grid=grid,
                    octave=tolerances.octave,
                )
            change = np.concatenate([change, 0.5 * form, 0.5 * uneven], axis=-1)
            blocks.append(LowRank.of(pose.jacobian(PredictedMeasurements(nominal, change, none))))
            shared = np.concatenate([shifts[k], uneven, form], axis=-1)
            columns.append(blocks[-1].whiten(pose.jacobian(PredictedMeasurements(nominal, shared, none))))
        return cls(tuple(blocks), LowRank.of(np.concatenate(columns)))

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the whitened covariance."""
        return self.common.log_determinant + sum(block.log_determinant for block in self.poses)

    def whiten(self, rows: np.ndarray) -> np.ndarray:
        """Rows (m,) or (m, c), whitened by the measurement alone, after whitening by both."""
        return self.common.whiten(self.by_pose(rows))

    def transposed(self, rows: np.ndarray) -> np.ndarray:
        """Sᵀ `rows` (m, c) of S, by which `whiten` multiplies."""
        return self.by_pose(self.common.whiten(rows))

    def by_pose(self, rows: np.ndarray) -> np.ndarray:
        """Rows (m,) or (m, c), whitened by the errors of each pose alone."""
        ends = np.cumsum([len(block.basis) for block in self.poses])
        return np.concatenate(
            [block.whiten(part) for block, part in zip(self.poses, np.split(rows, ends[:-1]), strict=True)]
        )


def unknown_shifts(model: ResponseModel, x: np.ndarray, tolerances: Tolerances) -> list[np.ndarray]:
    """∂G (lines, E + S, E, g) of every pose by one standard deviation of each geometric error and of each entry of an inertia tensor, by
    forward differences.
    """
    base = model.responses(x)
    shifts: list[list[np.ndarray]] = [[] for _ in base]
    for robot in _erring(model.robot, tolerances):
        for k, response in enumerate(ResponseModel(robot, model.parameters, model.poses).responses(x)):
            shifts[k].append(response - base[k])
    return [np.stack(columns, axis=-1) for columns in shifts]


def _erring(robot: RobotModel, tolerances: Tolerances) -> Iterator[RobotModel]:
    """The robot with one error of one standard deviation after the other."""
    for joint in robot.joints:
        for key in GEOMETRY:
            size = tolerances.length if key.startswith("length") else tolerances.angle
            name = f"{joint.name}.{key}"
            yield robot.with_values({name: robot.value(name) + size})
    for link, entry, std in uncertain_tensor_entries(robot) if tolerances.inertia else ():
        a, b = ("xyz".index(axis) for axis in entry[1:])
        inertia = robot.links.inertia.copy()
        inertia[link, a, b] += std
        inertia[link, b, a] = inertia[link, a, b]
        yield replace(robot, links=replace(robot.links, inertia=inertia))
