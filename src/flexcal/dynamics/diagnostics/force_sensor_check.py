"""Ratio of the external torques seen by the motors to the measured ones: a check of sign, unit and frame of a force sensor."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.estimators import Unknowns, noise_levels, weighted_system
from flexcal.dynamics.inverse_model import Column, Memory
from flexcal.dynamics.regression import RegressionData, batch_covariance
from flexcal.dynamics.signals import Motion
from flexcal.estimation import student_quantile
from flexcal.model.robot import RobotModel

_NAME = "external.excess"
_INDEPENDENT = 1e-6
"""Share of the column not explained by the base parameters, below which they absorb it."""


@dataclass(frozen=True)
class ExternalExcess:
    """Drive term `external.excess` · (-τ_ext) of every joint: the relative excess of the external torques; zero for a correct sensor."""

    def columns(self, model: RobotModel, motion: Motion, memory: Memory) -> Iterator[Column]:
        outside = np.zeros_like(motion.torque) if motion.external is None else motion.external
        for joint in range(model.n):
            yield Column(_NAME, joint, -outside[:, joint])


@dataclass(frozen=True)
class ExternalShare:
    """Ratio of motor to sensor torques, 1 if both agree, and its 95 % interval from `low` to `high`."""

    share: float
    low: float
    high: float


def external_share(data: RegressionData) -> ExternalShare | None:
    """Ratio by weighted least squares of equations whose terms include `ExternalExcess`, beside all base parameters.

    None where the external torques are zero or cannot be told from the base parameters. Raises `FlexcalError` as `noise_levels` does.
    """
    noise = noise_levels(data)
    system = weighted_system(data, noise)
    number = data.names.index(_NAME)
    unknowns = Unknowns.of(data, system)
    column = system.matrix[:, number]
    others = system.matrix[:, unknowns.kept]
    basis = np.linalg.qr(others / np.linalg.norm(others, axis=0))[0]
    left = column - basis @ (basis.T @ column)
    if not np.linalg.norm(left) > _INDEPENDENT * np.linalg.norm(column):
        return None
    wide = Unknowns(data, [*unknowns.kept, number], unknowns.hidden)
    factor, scale = wide.reduced(system)
    parameters = data.observation.values()
    parameters[wide.kept] += scale * np.linalg.solve(factor[:-1, :-1], factor[:-1, -1])
    root = scale[:, None] * np.linalg.solve(factor[:-1, :-1], np.eye(len(wide.kept)))
    chi2 = float(factor[-1, -1] ** 2) / wide.freedom(system)
    uncertainty = batch_covariance(data, noise, parameters, wide.kept, root, chi2)
    half = student_quantile(0.975, uncertainty.freedom) * float(np.sqrt(uncertainty.covariance[-1, -1]))
    share = 1.0 + float(parameters[number])
    return ExternalShare(share, share - half, share + half)
