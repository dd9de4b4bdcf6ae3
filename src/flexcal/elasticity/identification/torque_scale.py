"""Whether all inertia came out too large or too small by one factor, as by torques in another unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.elasticity.identification.fit import ResponseFit
from flexcal.model.robot import DRIVE_GAIN, MASS_AND_COM

CERTAIN = 1e-3
"""Significance level of the conflict between what was known of the inertia and what the responses say."""
_SHARE = 0.7
"""Least share of the conflict that one factor explains."""
_ROTOR = "rotor_inertia"


@dataclass(frozen=True)
class TorqueScale:
    """All masses and rotor inertias are `factor` times what was known of them, beyond chance with `probability`.

    Responses are accelerations by torques: torques that are too large by a factor make inertia, stiffness and damping too large by the
    same, and fit as well, as the equations of motion are linear in all of them. Nothing in the responses tells that from masses that are.
    """

    factor: float
    probability: float

    @property
    def log_std(self) -> float:
        """How well stiffnesses are known then, 1σ of their logarithm."""
        return abs(float(np.log(self.factor)))

    def document(self) -> dict[str, Any]:
        """Entry of results.json."""
        return {"factor": self.factor, "p": self.probability}

    @classmethod
    def of(cls, fit: ResponseFit) -> TorqueScale | None:
        """Test of the prior of the inertia (Evans and Moshonov 2006) and of the torque constants, which share a common factor of the
        torques between them; None where there is no conflict, or one factor is not what makes it.
        """
        from scipy.special import chdtrc

        parameters, prior = fit.estimate.parameters, fit.problem.prior_covariance
        names = parameters.names
        own = [k for k, name in enumerate(names) if name.rpartition(".")[2] in (*MASS_AND_COM, _ROTOR)]
        if not own or prior is None:
            return None
        scaled = np.array([parameters[k].scale == "log" for k in own], dtype=float)
        rotors = np.array([names[k].endswith(_ROTOR) for k in own])
        if scaled.sum() < 2 or not rotors.any():
            return None
        # with the torques of the log: a rotor differs by its own drive gain, links by the mean of all
        gains = {name: k for k, name in enumerate(names) if name.endswith(f".{DRIVE_GAIN}")}
        by_log = np.eye(len(names))[own]
        for row, (k, rotor) in enumerate(zip(own, rotors, strict=True)):
            motor = f"{names[k].rpartition('.')[0]}.{DRIVE_GAIN}"
            of = [gains[motor]] if rotor and motor in gains else list(gains.values())
            by_log[row, of] = -scaled[row] / max(len(of), 1)
        known = by_log @ prior @ by_log.T
        off = by_log @ (parameters.coordinates() - parameters.prior_mean())
        std = np.sqrt(np.diag(known))
        weight = np.linalg.pinv(known / np.outer(std, std), hermitian=True) / np.outer(std, std)
        square = float(off @ weight @ off)
        along = float(scaled @ weight @ off) / float(scaled @ weight @ scaled)
        probability = float(chdtrc(len(own), square))
        explained = along**2 * float(scaled @ weight @ scaled)
        if probability > CERTAIN or explained < _SHARE * square:
            return None
        return cls(float(np.exp(along)), probability)
