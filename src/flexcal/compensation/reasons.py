"""Why a target has no command, in a sentence that names the joints."""

from __future__ import annotations

import numpy as np

from flexcal.compensation.aim import Aim
from flexcal.compensation.newton import Commands
from flexcal.model import RobotModel
from flexcal.model.joint_space import joint_limits
from flexcal.units import MILLIMETRE

_SHARE = 0.3
"""Of the largest part in a motion, from which on a joint is named."""


def nominal_reasons(model: RobotModel, aim: Aim, nearest: np.ndarray) -> list[str]:
    """What keeps the nominal robot from K aims: `nearest` (K, n) is as near as it comes within its limits."""
    residual, _ = aim.nominal(model, nearest)
    weakest = _weakest_motion(model, aim, nearest)
    return [
        f"out of reach: the nominal tool {_nearest(model, q, away, motion)}"
        for q, away, motion in zip(nearest, residual, weakest, strict=True)
    ]


def real_reasons(model: RobotModel, aim: Aim, nominal: np.ndarray, commands: Commands) -> list[str]:
    """What keeps the real robot from K aims that the nominal one takes at `nominal` (K, n): `commands` that were not found."""
    there = aim.reached(commands.after)
    weakest = _weakest_motion(model, aim, np.where(there[:, None], nominal, commands.q))
    return [
        f"out of reach: the real tool {_nearest(model, q, away, motion)}"
        if not near
        else _past_limit(model, q) or _singular(model, q - start, motion)
        for q, away, near, start, motion in zip(
            commands.q, commands.after, there, nominal, weakest, strict=True
        )
    ]


def _nearest(model: RobotModel, q: np.ndarray, away: np.ndarray, weakest: np.ndarray) -> str:
    lower, upper = joint_limits(model)
    place = f"comes no nearer than {np.linalg.norm(away[:3]) / MILLIMETRE:.3g} mm"
    if len(away) > 3:
        place += f" and {np.linalg.norm(away[3:]):.3g} rad"
    stuck = [j for j in range(model.n) if q[j] in (lower[j], upper[j])]
    if stuck:
        return f"{place}, with {_named(model, stuck)} at the limit"
    return f"{place}, where {_tied(model, weakest)}"


def _past_limit(model: RobotModel, q: np.ndarray) -> str | None:
    lower, upper = joint_limits(model)
    beyond = np.maximum(lower - q, q - upper)
    joint = int(np.argmax(beyond))
    if not beyond[joint] > 0:
        return None
    unit, limit = _unit(model, joint), lower[joint] if q[joint] < lower[joint] else upper[joint]
    return f"joint limit: {model.joint_names[joint]} would be {beyond[joint]:.2g} {unit} past its limit of {limit:.5g} {unit}"


def _singular(model: RobotModel, correction: np.ndarray, weakest: np.ndarray) -> str:
    joint = int(np.argmax(np.abs(correction)))
    size = f"{abs(correction[joint]):.2g} {_unit(model, joint)}"
    return f"singular: {_tied(model, weakest)}, and the correction would move {model.joint_names[joint]} by {size}"


def _tied(model: RobotModel, weakest: np.ndarray) -> str:
    """The joints that a motion which hardly moves the tool consists of."""
    part = np.abs(weakest)
    joints = np.flatnonzero(part > _SHARE * part.max()).tolist()
    if len(joints) == 1:
        return f"{model.joint_names[joints[0]]} hardly moves the tool"
    return f"{_named(model, joints)} can move together and hardly move the tool"


def _named(model: RobotModel, joints: list[int]) -> str:
    names = [model.joint_names[j] for j in joints]
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _weakest_motion(model: RobotModel, aim: Aim, q: np.ndarray) -> np.ndarray:
    """The joint motions (K, n) of unit length that move the nominal tool least, of those that can move it."""
    _, jacobian = aim.nominal(model, q)
    return np.linalg.svd(jacobian * aim.weight(model)[:, None], full_matrices=False)[2][:, -1]


def _unit(model: RobotModel, joint: int) -> str:
    return "m" if model.joints[joint].kind == "prismatic" else "rad"
