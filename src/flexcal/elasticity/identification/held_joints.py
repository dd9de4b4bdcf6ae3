"""Drive springs of held joints: score test and selection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.elasticity.identification.fit import ResponseData, ResponseFit
from flexcal.elasticity.identification.score_test import score_test_rejects
from flexcal.elasticity.response_model import PredictedMeasurements, ResponseModel, held_inertia_name
from flexcal.estimation import profile_cost_increase
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.model.robot import RobotModel
from flexcal.model.vibration import linearise

DAMPING_RATIO = 0.1
"""Initial damping ratio of a spring at the highest line."""

NEARLY_RIGID = 1e3
"""Stiffness, relative to that with a mode at the highest line, at which a joint counts as rigid."""

INDIFFERENT = 2.0
"""Gain in χ² below which one of several springs is dropped: the data do not distinguish it from a rigid joint."""


@dataclass(frozen=True)
class CompliantHeldJoints:
    """Rigid revolute joints that may be compliant, by index, each with a spring (N m/rad, N m s/rad) whose mode is at the highest line."""

    springs: dict[int, tuple[float, float]]

    @classmethod
    def of(cls, model: RobotModel, responses: Sequence[FrequencyResponse]) -> CompliantHeldJoints:
        """All rigid revolute joints of `model`; the inertia about each axis is the median over the poses of `responses`."""
        rigid = [
            i
            for i, joint in enumerate(model.joints)
            if i not in model.springs.bearing_frames and joint.kind == "revolute"
        ]
        if not rigid:
            return cls({})
        compliant = model.with_drive_springs(dict.fromkeys(rigid, (1e12, 0.0)))
        axes = [(e.index, c) for e in compliant.elastic for c in e.components]
        rows = [len(compliant.driven) + axes.index((i, 2)) for i in rigid]
        inertia = np.median(
            [np.diag(linearise(compliant, r.q_mean, r.payload).mass)[rows] for r in responses], axis=0
        )
        omega = 2 * np.pi * max(float(r.frequencies_hz[-1]) for r in responses)
        return cls(
            {
                i: (omega**2 * float(size), 2 * DAMPING_RATIO * omega * float(size))
                for i, size in zip(rigid, inertia, strict=True)
                if size > 0
            }
        )

    def only(self, joints: Sequence[int]) -> CompliantHeldJoints:
        """Subset of the joints."""
        return CompliantHeldJoints({i: self.springs[i] for i in joints})

    def is_supported(self, model: RobotModel, data: ResponseData, fit: ResponseFit) -> bool:
        """Whether the residual of `fit`, with all these joints rigid, supports their compliances.

        Rao's score test by their compliances.
        """
        return bool(self.springs) and score_test_rejects(fit, data, fit.whiten(self._shifts(model, fit)))

    def _shifts(self, model: RobotModel, fit: ResponseFit) -> np.ndarray:
        """Change (m, k) of the residual by each compliance, in units of that of `springs`, by a forward difference from rigid."""
        residual, parameters = fit.residual, fit.estimate.parameters
        base, columns = residual.model.responses(fit.x), []
        for i, (stiffness, _) in self.springs.items():
            yielding = model.with_drive_springs({i: (NEARLY_RIGID * stiffness, 0.0)})
            moved = ResponseModel(yielding, parameters, residual.model.poses).responses(fit.x)
            none = np.empty(0, dtype=int)
            columns.append(
                np.concatenate(
                    [
                        pose.jacobian(
                            PredictedMeasurements(still, NEARLY_RIGID * (g - still)[..., None], none)
                        )[:, 0]
                        for pose, still, g in zip(residual.poses, base, moved, strict=True)
                    ]
                )
            )
        return np.stack(columns, axis=1)

    def least_significant(self, model: RobotModel, data: ResponseData, fit: ResponseFit) -> int | None:
        """Joint whose rigidity raises the misfit of `fit` least, if insignificantly; None if all springs are needed."""
        worth = {i: _worth(model, fit, i) for i in self.springs}
        least = min(worth, key=lambda i: worth[i])
        variance = max(1.0, fit.estimate.reduced_chi2) * data.tolerances.inflation(data.responses)
        return least if worth[least] < INDIFFERENT * variance else None


def _worth(model: RobotModel, fit: ResponseFit, joint: int) -> float:
    """Rise of χ² if one joint becomes rigid and all other parameters are fitted again, without the priors of its spring."""
    name, parameters = model.joint_names[joint], fit.estimate.parameters
    own = [f"{name}.drive.stiffness", f"{name}.drive.damping", held_inertia_name(name)]
    numbers = [parameters.index(item) for item in own if item in parameters]
    prior = fit.problem.prior_covariance
    assert prior is not None
    prior = prior.copy()
    prior[numbers], prior[:, numbers] = 0.0, 0.0
    prior[numbers, numbers] = np.inf
    problem = replace(fit.problem, prior_covariance=prior)
    start = fit.x
    distance = (start - fit.problem.parameters.prior_mean())[numbers] / parameters.prior_std()[numbers]
    rigid = start.copy()
    rigid[numbers[0]] += np.log(NEARLY_RIGID)
    own_prior = 0.5 * float(distance @ distance)
    return 2 * (profile_cost_increase(problem, fit.estimate, rigid, numbers) + own_prior)
