"""Parameters of a guided session with their priors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.calibration.fit import ElasticPrior, geometric_parameters, plausible_size
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.model.robot import RobotModel

_REACH = 2.0
"""Largest change of stiffness, inertia and payload, in units of their prior, about which points are linearised."""
_WARMED = 1.0
"""Differences of the temperature, K, above which an expansion of the arm is allowed for."""
TERMS = ("kinematic", "backlash", "gravity_compliance")
"""Terms that are fitted during the measurement, beside the expansion of the arm where rows have its temperature; all with the plausible
sizes of their parameters as prior.
"""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The p parameters of a session in units of their prior: `root` (p, p) turns standard normal numbers into changes of the parameters.

    The first `geometric` names are those of the geometry; the others are stiffness, inertia and payload. Changes of the `logarithmic` ones
    (p,), the stiffnesses, are those of the natural logarithm.
    """

    names: tuple[str, ...]
    geometric: int
    root: np.ndarray
    logarithmic: np.ndarray

    @classmethod
    def of(cls, model: RobotModel, poses: PoseSet) -> Unknowns:
        """Parameters that move the measured points of `poses`, with plausible sizes, and the model's knowledge of its elasticity."""
        warmed = poses.temperature is not None and np.ptp(poses.temperature) > _WARMED
        free = geometric_parameters(model, poses, (*TERMS, "thermal") if warmed else TERMS)
        elastic = ElasticPrior.of(model, poses)
        sizes = np.array([plausible_size(model, name) for name in free.names])
        count = len(sizes)
        root = np.zeros((count + len(elastic.parameters),) * 2)
        root[:count, :count] = np.diag(sizes)
        values, vectors = np.linalg.eigh(elastic.covariance)
        root[count:, count:] = vectors * np.sqrt(np.maximum(values, 0.0))
        logarithmic = [False] * count + [parameter.scale == "log" for parameter in elastic.parameters]
        return cls((*free.names, *elastic.parameters.names), count, root, np.array(logarithmic))

    def __len__(self) -> int:
        return len(self.names)

    def columns(self, model: RobotModel, poses: PoseSet) -> tuple[np.ndarray, np.ndarray]:
        """Predicted points (N, 3), m, and their derivatives (N, 3, p) by the parameters in units of their prior."""
        at = predict_measurements(model, poses, jacobians=True)
        slopes = np.where(self.logarithmic, [model.value(name) for name in self.names], 1.0)
        return at.position, (at.jacobian(self.names) * slopes) @ self.root

    def within_reach(self, values: np.ndarray) -> np.ndarray:
        """Values (p,), those of stiffness, inertia and payload at most so far from what is expected as they are physical."""
        reach = np.where(np.arange(len(self)) < self.geometric, np.inf, _REACH)
        return np.clip(values, -reach, reach)

    def moved(self, model: RobotModel, change: np.ndarray) -> RobotModel:
        """Robot changed by `change` (p,) in units of the prior."""
        before = np.array([model.value(name) for name in self.names])
        step = self.root @ change
        after = np.where(
            self.logarithmic, before * np.exp(np.where(self.logarithmic, step, 0.0)), before + step
        )
        return model.with_values(dict(zip(self.names, after.tolist(), strict=True)))
