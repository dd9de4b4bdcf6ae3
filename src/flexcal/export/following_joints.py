"""Joints that follow others, in formats that know at most one joint following one other."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics import joint_motion
from flexcal.model.robot import RobotModel


def joint_values(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Positions (samples, N) of all joints of an exported robot at the motors' `q` (samples, n), its offsets being in the placements."""
    if model.relations is None:
        return q
    motion = joint_motion(model, q, np.zeros((len(q), len(model.joints), 3)), derivatives=False)
    return motion.q + motion.deflection[:, :, 2] + model.geometry.errors[:, 0] - model.joint_offsets


def followed_joints(model: RobotModel) -> dict[int, tuple[dict[int, float], float]]:
    """For every joint with a linear relation: the joints that it follows with the ratios, itself if it has a motor too, and its offset."""
    relations = model.relations
    if relations is None:
        return {}
    direct, result = relations.ratios, {}
    for i in range(len(model.joints)):
        of = {int(j): float(direct[i, j]) for j in np.flatnonzero(direct[i])}
        own = float(relations.by_motor[i].sum())
        if of or own not in (0.0, 1.0) or relations.shift[i]:
            result[i] = ({i: own} | of if own else of), float(relations.shift[i])
    return result


def mimicked(model: RobotModel) -> dict[int, tuple[int, float, float]]:
    """Joints that follow one other and nothing else: which, the ratio, and the offset."""
    return {
        i: (next(iter(of)), next(iter(of.values())), offset)
        for i, (of, offset) in followed_joints(model).items()
        if len(of) == 1 and i not in of
    }


def relation_remarks(model: RobotModel, format_name: str, *, mimics: bool = True) -> tuple[str, ...]:
    """Sentences on the relations that a format cannot say; one with `mimics` knows joints that follow one other."""
    names, held = model.joint_names, mimicked(model) if mimics else {}
    sentences = []
    for i, (of, offset) in followed_joints(model).items():
        if i not in held:
            terms = " ".join(
                f"{ratio:+.9g} {names[j]}{' (its motor)' if j == i else ''}" for j, ratio in of.items()
            )
            shift = f" {offset:+.9g}" if offset else ""
            sentences.append(
                f"{format_name} cannot say that {names[i]} follows other joints: whoever moves the model sets it to {terms}{shift}."
            )
    for loop in () if model.relations is None else model.relations.loops:
        listed = " and ".join(names[i] for i in loop.passive)
        sentences.append(
            f"{format_name} has no loops: whoever moves the model closes '{loop.name}' by {listed}; where its calibrated frames are is in "
            "estimates.yaml."
        )
    return tuple(sentences)
