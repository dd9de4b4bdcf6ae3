"""Selection of the next poses given measured ones, and the stopping criterion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexcal.data.poses import PoseSet
from flexcal.design.optimality import DOptimal, TraceOptimal, greedy, trace_lower_bound
from flexcal.design.poses.feasibility import PoseCandidates
from flexcal.design.poses.geometry_sensitivity import BLOCK, geometry_jacobian, measuring_noise
from flexcal.design.poses.selection import CriterionName, PoseDesign, criterion_named, tool_error
from flexcal.design.scene import MeasuringSetup
from flexcal.errors import FlexcalError
from flexcal.estimation import Sensitivity
from flexcal.model.robot import RobotModel

AVERAGING = 0.2
"""Excess of the predicted error over its lower bound for as many poses, relative, from which more poses do little but average."""


@dataclass(frozen=True, eq=False)
class NextPoses:
    """Next K poses of `design`, the best first, each the best after those before it and the `measured` ones (their number).

    `tool_error` (K + 1,), m, is predicted after none, one, ... of them; `possible` (K + 1,) is what no choice of as many poses in all
    could be below. The `base` of the design counts the measured poses as known before.
    """

    design: PoseDesign
    measured: int
    tool_error: np.ndarray
    possible: np.ndarray

    def enough(self, desired_error: float | None = None) -> int | None:
        """Number of these poses after which to stop: the tool error is at most `desired_error` (m), or more only average; None for
        never.
        """
        limit = (1 + AVERAGING) * self.possible if desired_error is None else desired_error
        good = np.flatnonzero(self.tool_error <= limit)
        return int(good[0]) if len(good) else None


def select_next_poses(
    candidates: PoseCandidates,
    measured: PoseSet,
    count: int,
    *,
    rng: np.random.Generator,
    criterion: CriterionName = "c",
) -> NextPoses:
    """Choose the `count` candidates that, one after the other, add most to the information of `measured` poses and tolerances.

    `criterion` is c, A or D. Where the measured poses say how noisy they are, the next ones are taken to be as noisy.

    Raises `FlexcalError` for another criterion, for fewer candidates, and for poses measured with another target, from another station, or
    with a draw-wire.
    """
    merit = criterion_named(criterion, candidates.tool_error_weight)
    if not isinstance(merit, DOptimal | TraceOptimal):
        raise FlexcalError(
            "E-DESIGN-029", f"the criterion of the next poses must be c, A or D, not {criterion}."
        )
    before = candidates.base.sensitivity
    added, noisier = measured_information(candidates, measured)
    information = before.prior_information + added
    known = Sensitivity(before.jacobian / noisier, before.parameters, information)
    base = replace(candidates.base, sensitivity=known)
    selection = greedy(known, count, merit)
    done = len(np.unique(measured.pose))
    steps = range(count + 1)
    errors = [tool_error(base, candidates.tool_error_weight, selection.chosen[:number]) for number in steps]
    alone = replace(known, prior_information=before.prior_information)
    least = (
        trace_lower_bound(alone, TraceOptimal(candidates.tool_error_weight, "c"), done + np.array(steps))
        ** 0.5
    )
    design = PoseDesign.of(replace(candidates, base=base), merit, selection, rng)
    return NextPoses(design, done, np.array(errors), np.minimum(least, errors))


def measured_information(candidates: PoseCandidates, measured: PoseSet) -> tuple[np.ndarray, float]:
    """Information (rank, rank) of measured poses on the combinations that the candidates separate, and their noise relative to the
    setup's.
    """
    _check(candidates.model, measured, candidates.setup)
    information, noisier = np.zeros(2 * (len(candidates.base.scale),)), []
    for first in range(0, len(measured), BLOCK):
        rows, ratio = _rows(candidates, measured.subset(slice(first, first + BLOCK)))
        flat = rows.reshape(-1, rows.shape[2])
        information = information + flat.T @ flat
        noisier.append(ratio)
    return information, float(np.median(np.concatenate(noisier)))


def _rows(candidates: PoseCandidates, measured: PoseSet) -> tuple[np.ndarray, np.ndarray]:
    """Whitened rows (N, 3, rank) and noise relative to the setup's (N, 3)."""
    model, setup = candidates.model, candidates.setup
    payload = np.full(len(measured), np.nan) if measured.payload is None else measured.payload
    rows = np.zeros((len(measured), 3, len(candidates.base.scale)))
    for mass in np.unique(payload):
        of_mass = np.isnan(payload) if np.isnan(mass) else payload == mass
        own = replace(setup, payload=setup.payload if np.isnan(mass) else float(mass))
        rows[of_mass] = candidates.base.columns(geometry_jacobian(model, measured.q[of_mass], own)[1])
    expected = measuring_noise(model, measured.q, setup)[:, None]
    std = measured.sigma if measured.sigma_given else np.broadcast_to(expected, (len(measured), 3))
    return rows / std[..., None], std / expected


def _check(model: RobotModel, measured: PoseSet, setup: MeasuringSetup) -> None:
    target, station = model.point(setup.point).name, setup.station or model.stations.names[0]
    if measured.kind is not None:
        raise FlexcalError(
            "E-DESIGN-030", "the next poses are chosen after measured points, not after lengths of a wire."
        )
    for word, names, own in (("target", measured.targets, target), ("station", measured.stations, station)):
        if names != (own,):
            raise FlexcalError(
                "E-DESIGN-031",
                f"the measured poses hold the {word} {', '.join(names)}, but the next ones are chosen for {own}; give those only.",
            )
