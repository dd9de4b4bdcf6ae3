"""The pose that is to be measured next."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from flexcal.jobs.guidance import Outlook
    from flexcal.studio.steps.measure.series import Series

Order = Literal["as planned", "the best of the plan", "the best anywhere"]
ORDERS: tuple[Order, ...] = ("as planned", "the best of the plan", "the best anywhere")


@dataclass(frozen=True, eq=False)
class NextPose:
    """A pose to measure: its number, joint positions `q` (n,), rad or m, payload (kg; None: as declared), and whether it is planned."""

    number: int
    q: np.ndarray
    payload: float | None = None
    planned: bool = True

    @property
    def key(self) -> str:
        """Text that another pose does not have."""
        return f"{self.number} {sha256(self.q.tobytes()).hexdigest()[:16]} {self.payload}"


def orders(series: Series) -> tuple[Order, ...]:
    """The orders in which the poses of a series may be measured."""
    if series.purpose.is_check:
        return ORDERS[:1]
    return ORDERS if series.plan is not None else ORDERS[2:]


def next_pose(
    series: Series, order: Order, outlook: Outlook | None, wanted: str | None, skipped: frozenset[int]
) -> NextPose | None:
    """The next pose; None where there is none, or where the best one is not known yet.

    `wanted` is the key of the selected pose, which comes first where it is planned and has no row in use; poses of the numbers `skipped`
    are left out.
    """
    plan = series.plan
    if plan is not None:
        done = set(series.numbers[series.used & series.at_plan].tolist())
        for k, number in enumerate(plan.numbers.tolist()):
            if str(number) == wanted and number not in done:
                return planned(series, k)
    open_poses = [] if plan is None else [k for k in series.open_poses if int(plan.numbers[k]) not in skipped]
    if order == "as planned":
        return planned(series, open_poses[0]) if open_poses else None
    if outlook is None or not len(outlook.q):
        return None
    if order == "the best anywhere":
        return NextPose(series.free_number, outlook.q[0], planned=False)
    assert plan is not None
    index = {int(plan.numbers[k]): k for k in open_poses}
    return next((planned(series, index[n]) for n in outlook.pose.tolist() if n in index), None)


def planned(series: Series, index: int) -> NextPose:
    """A planned pose, by its index."""
    plan = series.plan
    assert plan is not None
    payload = None if plan.payload is None else float(plan.payload[index])
    return NextPose(int(plan.numbers[index]), plan.q[index], payload)
