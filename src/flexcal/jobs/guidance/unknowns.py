"""Parameters of a guided session with their priors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.calibration.fit import ElasticPrior, geometric_parameters, plausible_size
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.model.robot import RobotModel

TERMS = ("kinematic", "backlash", "gravity_compliance")
"""Terms that are fitted during the measurement, all with the plausible sizes of their parameters as prior."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The p parameters of a session in units of their prior: `root` (p, p) turns standard normal numbers into changes of the parameters.

    The first `geometric` names are those of the geometry; the others are stiffness, inertia and payload, in estimation coordinates.
    """

    names: tuple[str, ...]
    geometric: int
    root: np.ndarray
    slopes: np.ndarray

    @classmethod
    def of(cls, model: RobotModel, poses: PoseSet) -> Unknowns:
        """Parameters that move the measured points of `poses`, with plausible sizes, and the model's knowledge of its elasticity."""
        free = geometric_parameters(model, poses, TERMS)
        elastic = ElasticPrior.of(model, poses)
        sizes = np.array([plausible_size(model, name) for name in free.names])
        count = len(sizes)
        root = np.zeros((count + len(elastic.parameters),) * 2)
        root[:count, :count] = np.diag(sizes)
        values, vectors = np.linalg.eigh(elastic.covariance)
        root[count:, count:] = vectors * np.sqrt(np.maximum(values, 0.0))
        slopes = [1.0] * count + [p.value if p.scale == "log" else 1.0 for p in elastic.parameters]
        return cls((*free.names, *elastic.parameters.names), count, root, np.array(slopes))

    def __len__(self) -> int:
        return len(self.names)

    def columns(self, model: RobotModel, poses: PoseSet) -> tuple[np.ndarray, np.ndarray]:
        """Predicted points (N, 3), m, and their derivatives (N, 3, p) by the parameters in units of their prior."""
        at = predict_measurements(model, poses, jacobians=True)
        return at.position, (at.jacobian(self.names) * self.slopes) @ self.root

    def moved(self, model: RobotModel, change: np.ndarray) -> RobotModel:
        """Robot with the geometry changed by `change` (p,) in units of the prior."""
        step = (self.root @ change)[: self.geometric]
        names: Sequence[str] = self.names[: self.geometric]
        return model.with_values({n: model.value(n) + float(s) for n, s in zip(names, step, strict=True)})
