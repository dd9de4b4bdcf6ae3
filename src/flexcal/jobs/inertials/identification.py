"""Identification of link inertials with CAD as the prior: a robot model and recorded trajectories in, an estimate out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from flexcal.data.plans import TrajectoryPlan
from flexcal.data.recordings import Recording
from flexcal.dynamics.inertials import fit_inertials, trajectory_torques
from flexcal.dynamics.signals import LogFaults, external_torque
from flexcal.errors import InputError
from flexcal.jobs.inertials.result import InertialsIdentification
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

_SENSELESS = 0.5
"""Relative torque error from which the torques must be of another robot or unit."""
_READING = 0.7
"""Share of the progress assigned to reading the recordings."""


def identify_inertials(
    model: RobotModel,
    plan: TrajectoryPlan,
    recordings: Iterable[Recording],
    *,
    progress: Progress = silent,
) -> InertialsIdentification:
    """Fit masses, centres of mass, rotor inertias and friction to periodic trajectories, with CAD as the prior.

    Weighted least squares of the Fourier coefficients of a mean period (Swevers et al. 1997), with the tolerances of robot.yaml
    (`prior:`) as the prior.

    Parameters
    ----------
    model : RobotModel
        Nominal robot.
    plan : TrajectoryPlan
        Plan of the trajectories, as of `exciting_plan` or `design_trajectories`.
    recordings : iterable of Recording
        One for each trajectory of the plan, in their order, in SI units of the joints.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    InertialsIdentification
        Its `estimate`, `model`, `residuals`, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        Where a recording does not fit the plan or has a fault, a torque is zero throughout, or the torques are not of this robot.

    Examples
    --------
    >>> from flexcal import RobotModel, VirtualCell, exciting_plan, identify_inertials
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> plan = exciting_plan(model, count=1, seed=0)
    >>> inertials = identify_inertials(model, plan, VirtualCell(model).record(plan))
    >>> low, high = inertials.estimate.interval("link_3.mass")
    >>> bool(low < model.value("link_3.mass") < high)
    True
    """
    progress("dynamics", 0.0)
    recorded = []
    for number, recording in enumerate(recordings, start=1):
        recorded.append(_checked(recording, model))
        progress("dynamics", _READING * number / len(plan))
    estimate = fit_inertials(model, plan, recorded)
    identified = InertialsIdentification(
        model=model.with_estimate(estimate),
        estimate=estimate,
        nominal=model,
        before=trajectory_torques(model, plan, recorded),
        after=trajectory_torques(model.with_estimate(estimate), plan, recorded),
    )
    progress("dynamics", 1.0)
    if identified.error > _SENSELESS:
        raise InputError(
            "E-RUN-036",
            f"{recorded[0].name}: the relative torque error of the fit is {100 * identified.error:.0f} %, so the torques are not those of "
            "this robot's joints in N m; check signs, units and gear ratios under `signals:`.",
        )
    return identified


def _checked(recording: Recording, model: RobotModel) -> Recording:
    """Recording with the torques τ + τ_ext; raises `InputError` for faults of its sensors."""
    faults = LogFaults(Path(recording.name), model)
    faults.add(recording)
    faults.check()
    outside = external_torque(model, recording)
    return recording if outside is None else replace(recording, torque=recording.torque + outside)
