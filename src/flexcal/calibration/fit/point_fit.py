"""Input of a fit of the geometry to measured points, and its solution under one error model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexcal.calibration.error_model import (
    TRANSMISSION,
    ErrorComponents,
    ErrorGroups,
    joint_rotation_jacobian,
)
from flexcal.calibration.fit.elastic_prior import ElasticPrior, with_instruments
from flexcal.calibration.fit.fitted_points import FittedPoints
from flexcal.calibration.fit.fleet_prior import FleetPrior
from flexcal.calibration.fit.held_size import held_lengths
from flexcal.calibration.fit.least_squares_problem import GeometryProblem, PlainLoss
from flexcal.calibration.fit.marginalised_elasticity import marginalised
from flexcal.calibration.fit.practical_identifiability import Undetermined
from flexcal.calibration.fit.predictions import Predictions
from flexcal.calibration.fit.structural_identifiability import (
    kinematic_identifiability,
    random_identifiability,
    require_enough,
)
from flexcal.calibration.fit.terms import (
    declared_size,
    enough_for_terms,
    geometric_parameters,
    lag_parameters,
    plausible_size,
    random_waves,
)
from flexcal.calibration.fit.thermal_terms import THERMAL, with_reference_temperature
from flexcal.calibration.kinds import KINDS, wrong_readings
from flexcal.calibration.measurement import (
    ROBOT,
    PredictedMeasurements,
    Readings,
    predict_measurements,
    register,
    register_with_zeros,
    require_both_flanks,
    require_orientations,
    with_camera_places,
    with_places_of,
    with_stations_at_base,
    with_target_axes,
)
from flexcal.data.poses import PoseSet
from flexcal.estimation import Identifiability, Loss, Parameter, Parameters
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress

CONVERGED = 1e-9
"""Relative offset of a fit that has converged."""
_FLANK_PASSES = 4
_FIRST_SCATTER = 1e-4
"""Initial scatter (m) of a fit: its size matters relative to priors only."""
_FIRST_ORIENTATION = 2e-4
"""Initial scatter (rad) of measured orientations."""
_FAR_ZERO = 0.2
"""Plausible error of a joint zero, rad, where joint zeros are far off."""


@dataclass(frozen=True, eq=False)
class PointFit:
    """Input of a fit: the registered robot `start`, its `geometric` parameters, their rank on the `poses`, the elastic `prior`.

    `size` is the length that is held where no reading tells how large the robot is, `near` has values close to the solution, `far_zeros`
    tells whether joint zeros are far off; `kinds` are those of the parameters whose tolerances have a factor in common that was estimated
    from these poses.
    """

    start: RobotModel
    poses: PoseSet
    terms: tuple[str, ...]
    geometric: Parameters
    size: tuple[str, ...]
    identifiability: Identifiability
    structural: Identifiability
    prior: ElasticPrior
    elastic: bool
    marginalised: bool
    near: Mapping[str, float]
    far_zeros: bool
    progress: Progress
    fleet: FleetPrior | None = None
    kinds: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        model: RobotModel,
        poses: PoseSet,
        terms: tuple[str, ...],
        prior: ElasticPrior,
        elastic: bool,
        *,
        marginalised: bool,
        near: Mapping[str, float],
        placed: RobotModel | None = None,
        kept: Sequence[str] = (),
        progress: Progress,
        fleet: FleetPrior | None = None,
        kinds: Mapping[str, str] | None = None,
    ) -> PointFit:
        """Input without the term `transmission` for few poses, which do not determine its variance.

        Instruments stand and targets are mounted as on the robot that is `placed` already, if any, and else as registration finds them;
        of parameters that cannot be told apart those `kept` in another fit come first.

        Raises `FlexcalError` for a backlash seen from one flank and for too few poses.
        """
        if not enough_for_terms(poses):
            terms = tuple(term for term in terms if term != TRANSMISSION)
        model = model.with_stations(poses.places)
        model = model.with_lenses({name: lens.values for name, lens in poses.lenses.items()})
        if any(term.rpartition(".")[2] in THERMAL for term in terms):
            model = with_reference_temperature(model, poses)
        bare = with_stations_at_base(model)
        start = register(model, poses, predict_measurements(bare, poses, elastic=elastic).located)
        zeroed = register_with_zeros(start, poses)
        far_zeros = zeroed is not None
        mounted = with_target_axes(with_camera_places(zeroed or start, poses), poses)
        require_orientations(mounted, poses)
        start = with_places_of(start, mounted, poses) if far_zeros else mounted
        if placed is not None:
            start = with_places_of(start, placed, poses)
        prior = with_instruments(prior, start, poses)
        if "backlash" in terms:
            require_both_flanks(model, predict_measurements(start, poses, elastic=elastic).rest.flank)
        held = held_lengths(start, poses)
        geometric = geometric_parameters(start, poses, terms)
        geometric = Parameters(item for item in geometric if item.name not in held)
        if fleet is not None:
            fleet = fleet.among(geometric.names)
            geometric = fleet.applied(geometric)
        # zeros that are far off are to be found as such, not as lengths of links that are turned; that of the last joint may as well
        # be where the target is
        last = {start.point(target).joint for target in poses.targets}
        inner = [f"{joint.name}.offset" for i, joint in enumerate(start.joints) if i not in last]
        first = [name for name in inner if name in geometric] if far_zeros else []
        first += [name for name in kept if name in geometric and name not in first]
        known = () if fleet is None else fleet.names
        told = Parameters(item for item in geometric if item.name not in known)
        seen = kinematic_identifiability(start, poses, told, prefer=[name for name in first if name in told])
        without = Parameters(item for item in told if not np.isfinite(item.prior_std))
        if len(without) < len(told):
            require_enough(start, poses, without, kinematic_identifiability(start, poses, without))
        else:
            require_enough(start, poses, told, seen)
        if fleet is not None:
            # of the others those that pivoting keeps come first, so that the poses determine them beside what the prior tells
            first = [*first, *seen.kept_names]
            seen = kinematic_identifiability(start, poses, geometric, prefer=first)
        structural = random_identifiability(start, poses, geometric, seen)
        if structural.rank > seen.rank or poses.kind is not None:
            # these poses hide something: what may be off most, as the place of the instrument, is to take it up
            sizes = np.array([plausible_size(start, name) for name in geometric.names])
            seen = kinematic_identifiability(start, poses, geometric, scale=sizes, prefer=first)
            structural = random_identifiability(start, poses, geometric, seen, scale=sizes)
        return cls(
            start,
            poses,
            terms,
            geometric,
            held[:1],
            seen,
            structural,
            prior,
            elastic,
            marginalised,
            near,
            far_zeros,
            progress,
            fleet,
            kinds or {},
        )

    @cached_property
    def waves(self) -> dict[str, float]:
        """Waves of transmission errors with a common variance, and their sizes relative to order 1."""
        return random_waves(self.start, self.poses, self.geometric) if TRANSMISSION in self.terms else {}

    @cached_property
    def cells(self) -> ErrorGroups:
        """Groups of points that share an error."""
        return ErrorGroups.of(self.poses)

    @cached_property
    def predictions(self) -> Predictions:
        """Predicted measurements with changed parameters."""
        return Predictions(self.start, self.poses, self.elastic)

    @cached_property
    def straight(self) -> PredictedMeasurements:
        """Points of the undeflected robot at the start of the fit."""
        return predict_measurements(self.start, self.poses, elastic=False, jacobians=True)

    @property
    def has_wrong_readings(self) -> bool:
        """Whether single points are at the start of the fit far farther off than the others, as of a wrong reading."""
        if not self.poses.located.all():
            return False
        distance = np.linalg.norm(self.straight.residual[: len(self.poses)], axis=1)
        return bool(wrong_readings(distance).any())

    @property
    def first_scatter(self) -> ErrorComponents:
        """Initial error model: stated values, and typical ones of robots."""
        share = 1.0 if self.poses.sigma_given else 0.0
        orientation = _FIRST_ORIENTATION if self.poses.angled.any() else 0.0
        own: dict[str, Any] = dict.fromkeys((ROBOT, *Readings.of(self.poses).instruments), _FIRST_SCATTER)
        return ErrorComponents(share=share, orientation=orientation, **own)

    @property
    def hidden(self) -> tuple[str, ...]:
        """Parameters that random poses would determine, but neither these poses nor a declared prior."""
        seen = self.identifiability.kept_names
        declared = [p.name for p in self.geometric if np.isfinite(p.prior_std)]
        return tuple(name for name in self.structural.kept_names if name not in (*seen, *declared))

    @property
    def unknowns(self) -> int:
        """Number of parameters that the poses alone determine: of none that other robots of the model tell."""
        known = () if self.fleet is None else self.fleet.names
        return sum(name not in known for name in self.identifiability.kept_names)

    @cached_property
    def plausible(self) -> dict[str, float]:
        """Plausible deviation of every geometric parameter, a kept one with that of the dropped ones that it takes up."""
        every = self.identifiability
        sizes = {name: plausible_size(self.start, name) for name in self.geometric.names}
        if self.far_zeros:
            sizes |= {name: max(sizes[name], _FAR_ZERO) for name in sizes if name.endswith(".offset")}
        own = np.array([sizes[name] for name in every.names])
        taken_up = np.linalg.norm(every.regrouping * own, axis=1)
        return sizes | dict(zip(every.kept_names, taken_up.tolist(), strict=True))

    @property
    def free(self) -> Parameters:
        """Parameters determined by rank or a declared prior, scales that other lengths tell, and hysteresis of joints."""
        kept = self.identifiability.kept_names
        geometric = Parameters(p for p in self.geometric if p.name in kept or np.isfinite(p.prior_std))
        scales = Parameters(self._scales[int(self._size_is_a_scale) :])
        return geometric + scales + lag_parameters(self.start, self.poses)

    @cached_property
    def _beginning(self) -> dict[str, float]:
        """Values `near` the solution; parameters kept here take up those that were kept there and are dropped here."""
        every = self.identifiability
        lost = [name not in every.kept_names and name in self.free for name in every.names]
        nominal = np.array([self.start.value(name) for name in every.names])
        shift = np.array([self.near.get(name, 0.0) for name in every.names]) - nominal
        shift[[k for k, name in enumerate(every.names) if lost[k] or name not in self.near]] = 0.0
        moved = every.regrouping @ shift
        kept = {
            name: self.start.value(name) + float(change)
            for name, change in zip(every.kept_names, moved, strict=True)
        }
        return dict(self.near) | kept if self.near else {}

    @property
    def known(self) -> Parameters:
        """Parameters that are held at what is declared, within its standard deviation.

        Where sockets' distances or boards alone tell the size of the robot, the best known of their scales; where no reading does, a
        length of the robot.
        Errors of the joints grow with the robot, so a fit would make a smaller robot of fewer errors, and shorter distances.
        """
        lengths = [
            Parameter(name, "m", self.start.value(name), prior_std=plausible_size(self.start, name))
            for name in self.size
        ]
        return Parameters([*self._scales[: int(self._size_is_a_scale)], *lengths])

    @property
    def _size_is_a_scale(self) -> bool:
        """Whether lengths are told by sockets and boards alone, and not by wires, an instrument that measures points, or priors."""
        lengths = [p for p in self.geometric if ".length_" in p.name and not p.name.startswith("tool.")]
        return not all(np.isfinite(p.prior_std) for p in lengths) and not any(
            kind.tells_lengths(self.poses) and not kind.scales(self.poses) for kind in KINDS
        )

    @property
    def _scales(self) -> list[Parameter]:
        """Scales of sockets' distances and boards with their declared standard deviations, the best known first."""
        own = [name for kind in KINDS for name in kind.scales(self.poses)]
        sizes = {name: declared_size(self.start, name) for name in own}
        scales = [Parameter(name, "1", 0.0, prior_std=std) for name, std in sizes.items() if std is not None]
        return sorted(scales, key=lambda item: item.prior_std)

    def solved(
        self,
        scatter: ErrorComponents,
        loss: Loss | PlainLoss,
        near: FittedPoints | None = None,
        *,
        fixed: tuple[Undetermined, ...] = (),
        spread: dict[str, float] | None = None,
        tolerance: float = CONVERGED,
    ) -> FittedPoints:
        """Fit under a given scatter from the solution `near`, repeated until the flanks agree with the fitted robot.

        `fixed` parameters stay at their nominal values; `spread` are the standard deviations of the scatter's components; `tolerance` is
        that of `solve`.
        """
        names = [item.name for item in fixed]
        kept = Parameters(item for item in self.free if item.name not in names)
        if near is None:
            at = predict_measurements(self.start, self.poses, elastic=self.elastic, jacobians=True)
            turns = joint_rotation_jacobian(at)
        else:
            at, turns = near.at, near.turns
        values = self._beginning if near is None else near.estimate.values
        if self.start.relations is not None and self.start.relations.loops:
            # where a parameter is held that moved a loop far, the others' values may leave the loop open
            values = {} if near is None or fixed != near.fixed else values
        kept = Parameters(
            replace(p, value=values[p.name], prior_mean=p.value if p.prior_mean is None else p.prior_mean)
            if p.name in values
            else p
            for p in kept
        )
        whitening = scatter.weights(at.readings, turns)
        flank, prior = at.rest.flank, self.prior.beside(self.waves, scatter.transmission)
        prior = prior.started(values)
        passes = 0
        while True:
            task = GeometryProblem(self.predictions, kept, prior, flank, whitening, self.fleet)
            if self.marginalised and len(prior.parameters):
                estimate = marginalised(task, progress=self.progress)
            else:
                estimate = task.reestimated(loss=loss, tolerance=tolerance, progress=self.progress)
            after = self.predictions.consistent(estimate.values, flank)
            if (after.rest.flank == flank).all():
                break
            flank, passes = after.rest.flank, passes + 1
            if "backlash" in self.terms:
                require_both_flanks(self.start, flank)
            if passes == _FLANK_PASSES:
                break
        return FittedPoints(self, scatter, spread or {}, fixed, estimate, after, flank, task)
