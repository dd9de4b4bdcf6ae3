"""Sequences of exciting trajectories: joints that move, and base parameters of each stage (Vandanjon et al. 1995)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from flexcal.design.trajectories.regressor_columns import DRIVE, BaseRegressor

SequenceName = Literal["links", "axes", "kinds"]


@dataclass(frozen=True)
class Stage:
    """One trajectory of a sequence: the moving joints, and the names of the base parameters to be determined."""

    moving: tuple[int, ...]
    parameters: tuple[str, ...]


def sequence(columns: BaseRegressor, name: SequenceName) -> tuple[Stage, ...]:
    """Sequence of stages. links: from the last to the first, each with those beyond it moving; axes: the outer half, then all for the
    inner one; kinds: inertias, then moments of gravity, then friction, all joints moving. Stages without parameters are left out.
    """
    model = columns.model
    everything = tuple(range(model.n))
    owner = {joint.link: k for k, joint in enumerate(model.joints)} | {
        joint: k for k, joint in enumerate(model.joint_names)
    }
    each = [(kept, *kept.rpartition(".")[::2]) for kept in columns.identifiability.kept_names]

    def of_joints(first: int, last: int) -> Stage:
        parameters = tuple(kept for kept, body, _ in each if first <= owner[body] < last)
        return Stage(everything[first:], parameters)

    def of_kinds(*keys: str) -> Stage:
        return Stage(everything, tuple(kept for kept, _, key in each if key.startswith(keys)))

    half = model.n // 2
    stages = {
        "links": [of_joints(k, k + 1) for k in reversed(everything)],
        "axes": [of_joints(half, model.n), of_joints(0, half)],
        "kinds": [of_kinds("I", DRIVE[0]), of_kinds("mc", "mass"), of_kinds(*DRIVE[1:])],
    }[name]
    return tuple(stage for stage in stages if stage.parameters)
