"""Reasons why a target has no command, naming the joints."""

from __future__ import annotations

import numpy as np

from flexcal.compensation.newton_search import CommandSearch
from flexcal.compensation.tool_target import ToolPoseTarget
from flexcal.model.kinematics import joint_limits
from flexcal.model.robot import RobotModel
from flexcal.units import MILLIMETRE

_SHARE = 0.3
"""Share of the largest component of a motion from which a joint is named."""


def given_past_limit(model: RobotModel, q: np.ndarray) -> np.ndarray:
    """Reasons for given joint positions (N, n) beyond a limit; empty texts for the others (N,)."""
    lower, upper = joint_limits(model)
    reasons = np.full(len(q), "", dtype=object)
    for k in np.flatnonzero(((q < lower) | (q > upper)).any(axis=1)):
        reasons[k] = _past_limit(model, q[k], "is")
    return reasons


def nominal_reasons(model: RobotModel, aim: ToolPoseTarget, nearest: np.ndarray) -> list[str]:
    """Reasons why the nominal robot cannot reach K targets; `nearest` (K, n) is its nearest posture within its limits."""
    residual, _ = aim.nominal(model, nearest)
    return [
        f"out of reach: {_nearest(away)}" + (f", with {_named(model, stuck)} at the limit" if stuck else "")
        for away, stuck in zip(residual, _at_limits(model, nearest), strict=True)
    ]


def real_reasons(search: CommandSearch) -> list[str]:
    """Reasons why the real robot cannot reach the targets of a search that the nominal one reaches.

    The two robots differ by millimetres, so it is a limit, or a singularity that asks for much motion to make up for little.
    """
    model, nominal = search.model, search.nominal
    reasons = []
    there, stuck = search.aim.reached(search.after), _at_limits(model, search.q)
    weakest = _weakest_motion(model, search.aim, nominal)
    for k, q in enumerate(search.q):
        if there[k]:
            reasons.append(
                _past_limit(model, q, "would be") or _large(model, q - nominal[k], _tied(model, weakest[k]))
            )
        elif stuck[k]:
            reasons.append(
                f"joint limit: {_nearest(search.after[k])}, with {_named(model, stuck[k])} at the limit"
            )
        else:
            reasons.append(f"singular: {_tied(model, weakest[k])}, and {_nearest(search.after[k])}")
    return reasons


def _at_limits(model: RobotModel, q: np.ndarray) -> list[list[int]]:
    lower, upper = joint_limits(model)
    return [np.flatnonzero(row).tolist() for row in (q == lower) | (q == upper)]


def _nearest(away: np.ndarray) -> str:
    turn = f" and {np.linalg.norm(away[3:]):.3g} rad" if len(away) > 3 else ""
    distance = np.linalg.norm(away[:3]) / MILLIMETRE
    return f"the smallest distance of the tool to the target is {distance:{'.0f' if distance >= 1000 else '.3g'}} mm{turn}"


def _past_limit(model: RobotModel, q: np.ndarray, verb: str) -> str | None:
    lower, upper = joint_limits(model)
    beyond = np.maximum(lower - q, q - upper)
    joint = int(np.argmax(beyond))
    if not beyond[joint] > 0:
        return None
    unit, limit = _unit(model, joint), lower[joint] if q[joint] < lower[joint] else upper[joint]
    return f"joint limit: {model.motor_names[joint]} {verb} {beyond[joint]:.2g} {unit} past its limit of {limit:.5g} {unit}"


def _large(model: RobotModel, correction: np.ndarray, tied: str) -> str:
    joint = int(np.argmax(np.abs(correction)))
    size = f"{abs(correction[joint]):.2g} {_unit(model, joint)}"
    return f"singular: {tied}, and the correction would move {model.motor_names[joint]} by {size}"


def _tied(model: RobotModel, weakest: np.ndarray) -> str:
    """Joints of a motion that hardly moves the tool."""
    part = np.abs(weakest)
    joints = np.flatnonzero(part > _SHARE * part.max()).tolist()
    if len(joints) == 1:
        return f"{model.motor_names[joints[0]]} hardly moves the tool"
    return f"{_named(model, joints)} can move together with hardly any motion of the tool"


def _named(model: RobotModel, joints: list[int]) -> str:
    names = [model.motor_names[j] for j in joints]
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _weakest_motion(model: RobotModel, aim: ToolPoseTarget, q: np.ndarray) -> np.ndarray:
    """Joint motions (K, n) of unit length with the least effect on the nominal tool, among joints that can move it."""
    _, jacobian = aim.nominal(model, q)
    return np.linalg.svd(jacobian * aim.weight(model)[:, None], full_matrices=False)[2][:, -1]


def _unit(model: RobotModel, joint: int) -> str:
    return "m" if model.motor_joints[joint].kind == "prismatic" else "rad"
