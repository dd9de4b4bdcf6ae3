"""Friction terms of the drives from `friction:` of robot.yaml and recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.recordings import Decimation
from flexcal.dynamics.estimators import weighted_least_squares
from flexcal.dynamics.friction.catalogue import LIBRARY, candidate_shapes, standard_terms
from flexcal.dynamics.friction.scale import ExcitationScale
from flexcal.dynamics.friction.significance import CandidateFit
from flexcal.dynamics.friction.stepwise import (
    Candidate,
    FrictionChoice,
    SelectionStep,
    best_shapes,
    candidate_columns,
    forward_selection,
)
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, DriveTerm, Observation
from flexcal.dynamics.regression import ExperimentSystem, RegressionData, folds
from flexcal.estimation import Estimate
from flexcal.model.parts import LINK_PARAMETERS
from flexcal.model.robot import RobotModel


@dataclass(frozen=True, eq=False)
class ModelUncertainty:
    """Model uncertainty: `deviations` (models, k) of the parameters `names` from those of the selected model, the first one."""

    names: tuple[str, ...]
    deviations: np.ndarray

    @classmethod
    def of(cls, estimates: Sequence[Estimate]) -> ModelUncertainty:
        """Deviations of the parameters identified in all `estimates`, the selected model's first."""
        names = estimates[0].parameters.names
        shared = np.all([estimate.identifiable for estimate in estimates], axis=0)
        values = np.array([estimate.parameters.coordinates()[shared] for estimate in estimates])
        return cls(tuple(name for name, seen in zip(names, shared, strict=True) if seen), values - values[0])

    def widened(self, estimate: Estimate) -> Estimate:
        """Estimate with its covariance increased by the mean square of the deviations.

        With equal weights of all models that is the unconditional variance of Buckland, Burnham & Augustin (1997) about the selected one.
        """
        at = {name: i for i, name in enumerate(estimate.parameters.names) if estimate.identifiable[i]}
        shared = [k for k, name in enumerate(self.names) if name in at]
        rows = self.deviations[:, shared] / np.sqrt(len(self.deviations))
        covariance = estimate.covariance.copy()
        numbers = [at[self.names[k]] for k in shared]
        covariance[np.ix_(numbers, numbers)] += rows.T @ rows
        return replace(estimate, covariance=covariance)

    def growth(self, estimate: Estimate) -> dict[str, float]:
        """Factor by which each standard deviation of a `widened` estimate has grown."""
        squares = np.mean(self.deviations**2, axis=0)
        factors = {}
        for name, square in zip(self.names, squares, strict=True):
            std = estimate.std(name) if name in estimate.parameters else None
            if std:
                factors[name] = float(1.0 / np.sqrt(max(1.0 - square / std**2, 1e-6)))
        return factors


_CLASSIC = ("viscous", "coulomb", "torque_offset")


@dataclass(frozen=True, eq=False)
class FrictionSelection:
    """Selected friction: all `terms` of the drives, the `names` of the friction terms, and the trials of the selection.

    `uncertainty` is that between the chosen terms and others that predict as well, None without such.
    """

    terms: tuple[DriveTerm, ...]
    names: tuple[str, ...]
    chosen: tuple[Candidate, ...]
    trials: tuple[SelectionStep, ...]
    uncertainty: ModelUncertainty | None = None

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the terms, each with its shape."""
        shapes = {candidate.name: candidate.label for candidate in self.chosen}
        return tuple(shapes.get(name, name) for name in self.names)


def select_friction(
    model: RobotModel,
    friction: str | tuple[str, ...],
    equations: Callable[[Observation], Sequence[ExperimentSystem]],
    decimation: Decimation,
) -> FrictionSelection:
    """Terms named by `friction`, with the shapes of library terms, and with "auto" also the terms, by cross-validation and significance.

    `equations` gives those of the fit for any observation, after `decimation`; nothing else is looked at. Raises `FlexcalError` for an
    unknown term, and as `weighted_least_squares` does.
    """
    names = _CLASSIC if isinstance(friction, str) else friction
    plain = CLASSIC if isinstance(friction, str) else standard_terms(names)
    library = LIBRARY if friction == "auto" else tuple(name for name in LIBRARY if name in names)
    if not library:
        return FrictionSelection(plain, names, (), ())
    scale = _scale(model, equations)
    candidates = [candidate for name in library for candidate in candidate_shapes(name, scale)]
    wide = Observation(model, (*plain, *candidates))
    systems = equations(wide)
    base = BaseParameters.of(Observation(model, plain)).identifiability
    fixed = [wide.names.index(name) for name in base.kept_names]
    reach = -(-2 * decimation.support // decimation.factor)
    blocks = folds(systems, wide.column_indices, len(wide.names), fixed, reach)
    groups = {candidate: candidate_columns(wide, candidate) for candidate in candidates}
    fit = CandidateFit(wide, systems, fixed)
    choice = (
        forward_selection(blocks, fixed, groups, fit.p_value)
        if friction == "auto"
        else best_shapes(blocks, fixed, groups, library)
    )
    taken = tuple(candidate.name for candidate in choice.chosen)
    return FrictionSelection(
        (*plain, *(candidate.term for candidate in choice.chosen)),
        (*(name for name in names if name not in library), *taken),
        choice.chosen,
        choice.trials,
        _spread(fit, choice, groups) if choice.rivals else None,
    )


def _spread(
    fit: CandidateFit, choice: FrictionChoice, groups: Mapping[Candidate, Sequence[int]]
) -> ModelUncertainty:
    of = {candidate.label: numbers for candidate, numbers in groups.items()}
    sets = [[c.label for c in choice.chosen], *choice.rivals]
    return ModelUncertainty.of([fit.estimate([n for label in labels for n in of[label]]) for labels in sets])


def _scale(
    model: RobotModel, equations: Callable[[Observation], Sequence[ExperimentSystem]]
) -> ExcitationScale:
    classic = Observation(model, CLASSIC)
    systems = equations(classic)
    data = RegressionData.of(classic, BaseParameters.of(classic), systems)
    parameters = weighted_least_squares(data).parameters.coordinates()
    return ExcitationScale.of(systems, classic, parameters[: len(LINK_PARAMETERS) * model.n])
