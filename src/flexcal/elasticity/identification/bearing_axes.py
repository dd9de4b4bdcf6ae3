"""Comparison of bearing axes fixed to the parent link with axes that turn with the child, from frequency responses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import NormalDist

from flexcal.elasticity.identification.fit import ResponseData, ResponseFit, first_fit, fit_responses
from flexcal.elasticity.identification.lack_of_fit import find_misfit, octaves_of
from flexcal.errors import FlexcalError
from flexcal.estimation import vuong_statistic
from flexcal.model.parts import Bearings
from flexcal.model.robot import RobotModel

CERTAIN = 3.0
"""Vuong's statistic from which a preference is significant."""


@dataclass(frozen=True)
class ResponseBearings:
    """Comparison of fits with bearings that tilt `before` and `after` the joint's rotation, from frequency responses.

    `declared` are those of robot.yaml, None where it has none. `statistic` is Vuong's over clusters of neighbouring lines, or where errors
    of the model are `coherent` of an octave, positive where `before` fits better; `preferred` the clearly better ones, None where both fit
    about as well.
    """

    declared: Bearings | None
    reduced_chi2: Mapping[Bearings, float]
    statistic: float
    coherent: bool = False

    @classmethod
    def compare(
        cls, declared: Bearings | None, before: ResponseFit, after: ResponseFit, *, coherent: bool
    ) -> ResponseBearings:
        """Comparison of two fits to the same responses, by the likelihood of each with its own model error and priors.

        Where errors of the model are `coherent` over frequency, the clusters are octaves of one pose.
        """
        first, second = (fit.problem.linearise(fit.x)[0] for fit in (before, after))
        groups = octaves_of(before) if coherent else before.problem.groups
        assert groups is not None
        statistic = vuong_statistic(first, second, groups, before.log_prior - after.log_prior)
        chi2: dict[Bearings, float] = {
            "before": before.estimate.reduced_chi2,
            "after": after.estimate.reduced_chi2,
        }
        return cls(declared, chi2, statistic, coherent)

    @property
    def preferred(self) -> Bearings | None:
        """Bearings that fit the responses significantly better."""
        if abs(self.statistic) < CERTAIN:
            return None
        return self.better

    @property
    def taken(self) -> Bearings:
        """Bearings to be used: the declared ones; without a declaration those that fit better."""
        return self.declared or self.better

    @property
    def better(self) -> Bearings:
        """Bearings that fit the responses better, significantly or not."""
        return "before" if self.statistic > 0 else "after"

    @property
    def undecided(self) -> bool:
        """Whether bearings are taken that are neither declared nor significantly preferred."""
        return self.declared is None and self.preferred is None

    @property
    def share_of_other(self) -> float:
        """Probability that those not taken are the true ones where nothing is declared: their weight in a mean of both (Buckland et al.
        1997). It follows from the normal distribution of the statistic, unless errors of the model are `coherent`: over few clusters that
        lack the same, a preference that is not significant says nothing.
        """
        return 0.5 if self.coherent else NormalDist().cdf(-abs(self.statistic))

    @property
    def contradicted(self) -> bool:
        """Whether the responses significantly prefer other bearings than the declared ones."""
        return self.preferred not in (None, self.taken)


def with_fitting_bearings(
    model: RobotModel,
    data: ResponseData,
    first: ResponseFit,
    complete: Callable[[RobotModel, ResponseFit], tuple[RobotModel, ResponseFit]],
) -> tuple[RobotModel, ResponseFit, ResponseBearings | None, ResponseFit | None]:
    """Fit completed by `complete` with the bearings to be used, from the robot's `first` fit or one with the other bearings; the
    comparison; and where that is undecided the completed fit with the others. From a fit with other axes `complete` searches with the
    springs that the robot has.

    Where completing the better one adds springs, bearings were not all that was missing: the other is then fitted with the same springs,
    from there, before they are compared; where drives slip, which wrong axes take up, from a search of its own as well. There is no
    comparison for a robot without bearings, or where one with the others has no fit.
    """
    if not model.has_bearings:
        return *complete(model, first), None, None
    other = model.with_bearings("before" if model.bearings == "after" else "after")

    def compared(own: ResponseFit, others: ResponseFit) -> ResponseBearings:
        # gains describe slipping drives on the mean only; a misfit is one of the better fit
        closer = min(own, others, key=lambda fit: fit.estimate.reduced_chi2)
        coherent = data.hysteresis or find_misfit(closer, data.responses) is not None
        before, after = (own, others) if model.bearings == "before" else (others, own)
        return ResponseBearings.compare(model.config.bearings, before, after, coherent=coherent)

    try:
        begun = {model.bearings: (model, first), other.bearings: (other, first_fit(other, data, first.x))}
    except FlexcalError:
        return *complete(model, first), None, None
    comparison = compared(first, begun[other.bearings][1])
    better = comparison.better
    robot, fit = complete(*begun[better])
    ended = {better: (robot, fit)}
    if robot.springs.braked != model.springs.braked:
        worse: Bearings = "before" if better == "after" else "after"
        robot = robot.with_bearings(worse)
        try:
            ended[worse] = (
                complete(robot, fit) if data.hysteresis else (robot, fit_responses(robot, data, fit.x))
            )
        except FlexcalError:
            return *ended[better], comparison, None
        comparison = compared(ended[model.bearings][1], ended[other.bearings][1])
    taken = comparison.taken
    robot, fit = ended.get(taken) or complete(*begun[taken])
    if not comparison.undecided:
        return robot, fit, comparison, None
    rest: Bearings = "before" if taken == "after" else "after"
    return robot, fit, comparison, (ended.get(rest) or complete(*begun[rest]))[1]
