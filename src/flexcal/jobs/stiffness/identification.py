"""Identification of stiffness and damping: a robot model and its frequency responses in, an estimate out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.identification import MultiStart, Search, fit_springs
from flexcal.elasticity.response_model import CovarianceWeighting, Weighting
from flexcal.frequency.periodic import FrequencyResponse
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
    fit = fit_springs(
        model,
        responses,
        rng=np.random.default_rng([seed, 1]),
        inertias_known=inertias_known,
        plan=plan,
        weighting=weighting,
        search=search,
        progress=progress,
    )
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
        remarks=stiffness_remarks(fit, model),
    )
