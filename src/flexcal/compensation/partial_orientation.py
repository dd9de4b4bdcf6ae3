"""Orientations asked of arms with four or five joints: about the directions in which they can turn their tool, where it is to be."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from flexcal.compensation.inverse_kinematics import inverse_kinematics
from flexcal.compensation.tool_target import ToolPoseTarget
from flexcal.model.robot import RobotModel

_CLOSE = 1.0
"""Rotation, degrees, by which an arm may miss an orientation, as one whose tool is not quite upright does."""


@dataclass(frozen=True, eq=False)
class PartlyOriented:
    """Targets `aim` whose rotation counts as far as an arm can turn its tool there, and positions `q` (N, n) of the motors.

    Masks (N,) of the targets that are `reached`, and of those `elsewhere`, from another start than the first only; `reason` (N,) why an
    orientation is not had, empty where it is.
    """

    aim: ToolPoseTarget
    q: np.ndarray
    reached: np.ndarray
    elsewhere: np.ndarray
    reason: np.ndarray


def partly_oriented(
    model: RobotModel, aim: ToolPoseTarget, count: int, starts: Iterable[np.ndarray]
) -> PartlyOriented:
    """Inverse kinematics of the undeflected robot whose tool turns by `count` joints beyond those of its position.

    From each of the `starts` (n,) or (N, n) in turn, for targets not reached yet.
    """
    size = len(aim.position)
    q, turns = np.zeros((size, model.n)), np.zeros((size, count, 3))
    reached, elsewhere = np.zeros(size, dtype=bool), np.zeros(size, dtype=bool)
    for k, start in enumerate(starts):
        rows = np.flatnonzero(~reached)
        if not len(rows):
            break
        own = aim.subset(rows)
        placed, _ = inverse_kinematics(
            model, replace(own, rotation=None), np.broadcast_to(start, q.shape)[rows]
        )
        turned, _ = inverse_kinematics(model, own, placed)
        about = _turns(model, own, turned, count)
        found, there = inverse_kinematics(model, own.about(about), turned)
        kept = there if k else np.ones(len(rows), dtype=bool)
        q[rows[kept]], turns[rows[kept]] = found[kept], about[kept]
        reached[rows[there]], elsewhere[rows[there]] = True, k > 0
    residual, _ = aim.nominal(model, q)
    missed = np.rad2deg(np.linalg.norm(residual[:, 3:], axis=1))
    reason = np.full(size, "", dtype=object)
    for k in np.flatnonzero(reached & (missed > _CLOSE)):
        reason[k] = (
            f"orientation: an arm of {3 + count} joints cannot turn its tool so; the nearest is {missed[k]:.3g}° off"
        )
    return PartlyOriented(aim.about(turns), q, reached, elsewhere, reason)


def _turns(model: RobotModel, aim: ToolPoseTarget, q: np.ndarray, count: int) -> np.ndarray:
    """Directions (N, count, 3) about which the tool turns most with its point at rest."""
    _, jacobian = aim.nominal(model, q)
    *_, axes = np.linalg.svd(jacobian[:, :3], full_matrices=True)
    turned = np.matmul(jacobian[:, 3:], np.swapaxes(axes[:, 3:], 1, 2))
    return np.swapaxes(np.linalg.svd(turned)[0][:, :, :count], 1, 2)
