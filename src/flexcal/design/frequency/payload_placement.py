"""Placement of the payload for the smallest standard deviations of the springs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.design.frequency.backlash_limit import within_preload
from flexcal.design.frequency.response_jacobian import response_parameters, response_sensitivity
from flexcal.design.frequency.response_noise import COMMON_SENSORS, ResponseSensors
from flexcal.design.frequency.spring_precision import largest_stiffness_std
from flexcal.errors import FlexcalError
from flexcal.model.parts import axis_rotation
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent

DIRECTIONS = 8
"""Number of places on the ring that are tried, the declared one first."""
_EVERY = 4


@dataclass(frozen=True)
class Placement:
    """A centre of mass `com` (3,) m in the payload's frame, and the largest predicted standard deviation `std` of a stiffness."""

    com: tuple[float, ...]
    std: float


def payload_placements(
    model: RobotModel,
    plan: MultisinePlan,
    sensors: ResponseSensors = COMMON_SENSORS,
    progress: Progress = silent,
) -> tuple[Placement, ...]:
    """Centres of mass on a ring about the last joint's axis, as far off it as declared, in the poses of `plan`; the first is declared.

    The excitation is lowered where a place strains a gap too much; places where next to nothing would be left are not in the result.
    Raises `FlexcalError` where no payload is declared or held, or where it hangs on the axis.
    """
    payload = model.payload
    if payload is None or plan.payload == 0 or not payload.mass > 0:
        raise FlexcalError(
            "E-DESIGN-007",
            f"{model.path} declares no payload for this plan, so no placement can be evaluated; add `payload:`.",
        )
    axis = model.joints[payload.joint].axis
    if np.linalg.norm(np.cross(axis, payload.com_in_link)) < 1e-3:
        raise FlexcalError(
            "E-DESIGN-008",
            f"the payload's centre of mass lies on the axis of {model.joint_names[payload.joint]}, so its direction has "
            f"no effect; declare in {model.path} its offset from the axis.",
        )
    places = []
    for number in range(DIRECTIONS):
        progress("payload", number / DIRECTIONS)
        turned = axis_rotation(axis, 2 * np.pi * number / DIRECTIONS) @ payload.com_in_link
        com = payload.rotation.T @ (turned - payload.translation)
        robot = model.with_values({f"payload.com_{key}": float(x) for key, x in zip("xyz", com, strict=True)})
        try:
            lowered = within_preload(robot, plan)
        except FlexcalError:
            continue
        parameters = response_parameters(robot, lowered)
        seen = response_sensitivity(robot, plan.poses, lowered, parameters, sensors, every=_EVERY)
        places.append(Placement(tuple(np.round(com, 6) + 0.0), largest_stiffness_std(seen)[1]))
    progress("payload", 1.0)
    return tuple(places)
