"""Identification of stiffness and damping: a robot model and its frequency responses in, an estimate out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.identification import MultiStart, Search, SpringFit, fit_springs
from flexcal.elasticity.response_model import CovarianceWeighting, Weighting
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.jobs.fleet_prior import ModelPrior, PooledUse, stiffness_conflict, with_stiffness
from flexcal.jobs.stiffness.remarks import further_joints, stiffness_remarks
from flexcal.jobs.stiffness.result import StiffnessIdentification
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.results import fitted_responses

_WEIGHTING = CovarianceWeighting()
_SEARCH = MultiStart()


def identify_stiffness(
    model: RobotModel,
    responses: Sequence[FrequencyResponse],
    *,
    plan: MultisinePlan | None = None,
    inertias_known: bool = False,
    weighting: Weighting = _WEIGHTING,
    search: Search = _SEARCH,
    seed: int = 0,
    prior: ModelPrior | None = None,
    progress: Progress = silent,
) -> StiffnessIdentification:
    """Fit stiffness and damping of drives and bearings to frequency responses (Neubauer et al. 2015, §4.2).

    The linearised elastic robot is fitted to all poses at once. Link inertials, rotor inertias, friction and delays are estimated too.

    Parameters
    ----------
    model : RobotModel
        Robot that the fit starts from, best nominal with the estimate of `identify_dynamics` or of the trajectories
        (`RobotModel.with_estimate`). Where it has an estimate of a parameter of this fit, its joint covariance is the prior, else what
        robot.yaml declares; its geometry is taken as exact. An estimate of springs from the same responses would count them twice.
    responses : sequence of FrequencyResponse
        Motor accelerations over motor torques, one matrix (L, n, n) per line and pose, 1/(kg m²), as of `frequency_responses`.
    plan : MultisinePlan, optional
        Plan of the experiment. With it the reference motion is part of the model; without, damping is biased upwards.
    inertias_known : bool
        Whether link and payload inertias are those of the model.
    weighting : Weighting
        Weights of the responses: by default the inverse of their covariance.
    search : Search
        Search for the start of the fit.
    seed : int
        Seed of the search.
    prior : ModelPrior, optional
        Stiffness of other robots of the model, the prior of the springs where it fits this robot; where it does not, by a test, the
        responses are fitted without.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    StiffnessIdentification
        Its `estimate`, `model`, `residuals`, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        Where the responses do not fit the robot.

    Examples
    --------
    One pose and few lines of the virtual cell, from one start:

    >>> from dataclasses import replace
    >>> from flexcal import RobotModel, VirtualCell, frequency_plan, frequency_responses, identify_stiffness
    >>> from flexcal.elasticity.identification import MultiStart
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> plan = frequency_plan(model, "examples/tx90l/frequency_poses.csv", "default", seed=0)
    >>> plan = replace(plan, poses=plan.poses[:1], lines=plan.lines[::9], amplitude=plan.amplitude[:, ::9])
    >>> plan = replace(plan, realisations=3, periods=2, settle_periods=1)
    >>> responses = list(frequency_responses(plan, VirtualCell(model).record(plan), pooled_lines=18))
    >>> search = MultiStart(starts=1, agreement=1)
    >>> result = identify_stiffness(model, responses, plan=plan, inertias_known=True, search=search)
    >>> low, high = result.estimate.interval("joint_2.drive.stiffness")
    >>> bool(low < model.value("joint_2.drive.stiffness") < high)
    True
    """

    def fitted(robot: RobotModel) -> SpringFit:
        return fit_springs(
            robot,
            responses,
            rng=np.random.default_rng([seed, 1]),
            inertias_known=inertias_known,
            plan=plan,
            weighting=weighting,
            search=search,
            progress=progress,
        )

    fit, use = _with_others(model, prior, fitted)
    measured = {response.pose for response in responses}
    return StiffnessIdentification(
        model=fit.robot(model),
        estimate=fit.estimate,
        fit=fit,
        responses=fitted_responses(fit, model),
        reference_known=plan is not None,
        missing_poses=()
        if plan is None
        else tuple(k + 1 for k in range(len(plan.poses)) if k not in measured),
        further_joints=further_joints(fit.estimate, model),
        remarks=(*(() if use is None else use.remarks), *stiffness_remarks(fit, model)),
        pooled=use,
    )


def _with_others(
    model: RobotModel, prior: ModelPrior | None, fitted: Callable[[RobotModel], SpringFit]
) -> tuple[SpringFit, PooledUse | None]:
    """Fit with the stiffness of other robots as prior, or without where that does not fit this one, and what was used of it.

    Whether it fits is told by the responses alone: a fit that is pulled to a wrong stiffness may find the errors elsewhere.
    """
    alone = fitted(model)
    if prior is None:
        return alone, None
    pooled = prior.stiffness

    def unused(why: str) -> tuple[SpringFit, PooledUse]:
        return alone, PooledUse("stiffness", prior.source, None, used=False, unused=why)

    if pooled is None:
        return unused("it has none")
    started, taken = with_stiffness(model, pooled)
    if taken is None:
        return unused("the robot declares none of its springs")
    axes = pooled.condition
    own = model.bearings if alone.bearings is None else alone.bearings.taken
    if axes and own != axes:
        return unused(f"it is of bearings '{axes}', and this robot was fitted with bearings '{own}'")
    test = stiffness_conflict(taken, alone.estimate)
    if test is not None and test.contradicted:
        return alone, PooledUse("stiffness", prior.source, taken, test, used=False)
    return fitted(started.with_bearings(own)), PooledUse("stiffness", prior.source, taken, test)
