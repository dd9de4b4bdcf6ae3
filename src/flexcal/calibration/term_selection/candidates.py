"""Candidate terms of a robot and its poses, and the reasons for excluding others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexcal.calibration.fit import (
    PER_JOINT,
    free_joints,
    geometric_parameters,
    loaded_compliances,
    moving_joints,
)
from flexcal.calibration.term_selection.thermal_candidates import thermal_candidates
from flexcal.data.poses import PoseSet
from flexcal.model.robot import ZERO_DRIFT, RobotModel
from flexcal.model.statics import carried_mass, certain_flank, gravity_moments, gravity_torque

_CLEAR = 0.2
"""Share of its largest gravity torque that a joint must carry in both directions for a backlash to be considered."""
_KNOWN = 0.5
"""Share of the poses at which the flank of a joint must be certain for its backlash to be considered."""
_LOAD = 1e-3
"""Gravity load, N m, below which a robot has none."""


_SINGLE_ORDERS = 3
"""Number of orders whose waves are terms of their own; the higher ones are random effects alone."""


@dataclass(frozen=True, eq=False)
class CandidateTerms:
    """Terms that may be added to the kinematic ones.

    `kinds` are whole terms, `single` terms of one joint by the kind that they belong to, `excluded` (term, reason) those that cannot be
    considered. `model` has the joints declared whose backlash is a candidate.
    """

    model: RobotModel
    kinds: tuple[str, ...]
    single: dict[str, tuple[str, ...]]
    excluded: tuple[tuple[str, str], ...]

    def with_thermal(self, poses: PoseSet, scatter: float) -> CandidateTerms:
        """These and the terms of temperature that `poses` can tell beside a `scatter`, m, of a coordinate."""
        thermal = thermal_candidates(self.model, poses, scatter)
        return replace(
            self,
            kinds=(*self.kinds, *thermal.kinds),
            single=self.single | ({ZERO_DRIFT: thermal.single} if thermal.kinds else {}),
            excluded=(*self.excluded, *thermal.excluded),
        )


def candidates(model: RobotModel, poses: PoseSet) -> CandidateTerms:
    """Terms to be considered on some poses, by gravity, the declared springs and the moving joints; those of temperature are not here."""
    joints = moving_joints(model, poses)
    masses = carried_mass(model, poses.payload, len(poses))
    torque = gravity_torque(model, poses.q, masses)
    most = max(
        float(np.abs(load).max(initial=0.0)) for load in (torque, gravity_moments(model, poses.q, masses))
    )
    kinds: list[str] = []
    single: dict[str, tuple[str, ...]] = {}
    excluded: list[tuple[str, str]] = []
    loaded = loaded_compliances(model, poses)
    for kind in PER_JOINT:
        free = free_joints(model, kind, joints)
        if most < _LOAD:
            excluded.append((kind, _without_load(model)))
        elif not free:
            excluded.append((kind, "robot.yaml declares springs in their place for every joint"))
        elif not geometric_parameters(model, poses, [kind]).names:
            excluded.append(
                (
                    kind,
                    "the gravity load on the joints without declared springs hardly varies over these poses",
                )
            )
        else:
            kinds.append(kind)
            names = [f"{model.joints[i].name}.{kind}" for i in free]
            single[kind] = tuple(
                n for n in names if loaded & set(geometric_parameters(model, poses, [n]).names)
            )
    if not model.backlash_joints:
        known = certain_flank(model, poses.q, torque, masses).mean(axis=0) > _KNOWN
        wider = _with_backlash(model, torque, [i for i in joints if known[i]])
        if wider is None:
            reason = (
                "gravity loads no joint from both sides, so backlash is not identifiable beside an offset"
                if _with_backlash(model, torque, joints) is None
                else "masses are not known well enough to tell the flank that a joint rests on at most poses"
            )
            excluded.append(("backlash", _without_load(model) if most < _LOAD else reason))
        else:
            model = wider
            kinds.append("backlash")
    kinds += ["ratio"] if geometric_parameters(model, poses, ["ratio"]).names else []
    kinds += [f"transmission_{order}" for order in model.drives.harmonics[:_SINGLE_ORDERS]]
    return CandidateTerms(model, tuple(kinds), single, tuple(excluded))


def _without_load(model: RobotModel) -> str:
    if not model.links.mass.any() and not model.payload_mass:
        return f"{model.urdf.name} gives its links no mass, so gravity torques are not known; add <inertial> elements to consider it"
    if not np.any(model.gravity):
        return "robot.yaml says that there is no gravity"
    return "gravity loads no joint"


def _with_backlash(model: RobotModel, torque: np.ndarray, joints: Sequence[int]) -> RobotModel | None:
    clear = _CLEAR * np.abs(torque).max(axis=0)
    both = (torque.max(axis=0) > clear) & (torque.min(axis=0) < -clear) & (clear > 0.1)
    names = tuple(model.joints[i].name for i in joints if both[i])
    if not names:
        return None
    return replace(
        model, config=replace(model.config, geometry=replace(model.config.geometry, backlash=names))
    )
