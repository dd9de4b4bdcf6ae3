"""Equations of recordings with and without a payload, and the predictions of their fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.payload import FlexibilityCorrection, PayloadEquations, PayloadFit, RobotPrior
from flexcal.dynamics.regression import RegressionData, batches_each
from flexcal.dynamics.signals import JointLog, Window
from flexcal.estimation import Estimate
from flexcal.jobs.logs import LogSegment, Preprocessing, assemble_log_systems, predict_log_torques
from flexcal.model.robot import RobotModel
from flexcal.parallel import ThisProcess
from flexcal.progress import silent


@dataclass(frozen=True, eq=False)
class PayloadLogEquations:
    """Equations of `logs`, each with its own `observations`, since springs deflect with its own motion."""

    logs: Sequence[JointLog]
    observations: Sequence[Observation]
    equations: PayloadEquations
    preprocessing: Preprocessing

    @classmethod
    def of(
        cls,
        model: RobotModel,
        logs: Sequence[JointLog],
        loaded: Sequence[bool],
        dynamics: Estimate | None,
        sources: tuple[str, ...],
        preprocessing: Preprocessing,
    ) -> PayloadLogEquations:
        """Equations with springs deflected by the payload of `model`; raises `FlexcalError` as `FlexibilityCorrection` and
        `experiment_system` do.
        """
        plain = Observation(model, CLASSIC)
        base = BaseParameters.of(plain)
        prior = RobotPrior.of(plain, base, dynamics, sources)
        observations, systems = [], []
        for log, with_payload in zip(logs, loaded, strict=True):
            wide = Observation(
                model,
                (*CLASSIC, FlexibilityCorrection.of(model, log, sources, None if with_payload else 0.0)),
            )
            observations.append(wide)
            systems += assemble_log_systems(
                [LogSegment(log, Window())],
                wide,
                preprocessing,
                batches=batches_each(len(logs)),
                workers=ThisProcess(),
                progress=silent,
            )
        assert model.payload is not None
        data = RegressionData.of(observations[-1], base, systems)
        return cls(logs, observations, PayloadEquations(data, loaded, model.payload, prior), preprocessing)

    def predictions(self, fit: PayloadFit) -> list[TorquePrediction]:
        """Measured torques of every log, and those predicted by the `fit` of these equations."""
        predicted = [
            (observation, self.equations.coefficients(fit.unknowns, with_payload))
            for observation, with_payload in zip(self.observations, self.equations.loaded, strict=True)
        ]
        return predict_log_torques(
            self.logs, [np.inf] * len(self.logs), predicted, self.preprocessing, progress=silent
        )
