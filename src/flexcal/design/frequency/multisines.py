"""Flat multisines under a reference motion within the robot's limits, the start of every frequency design."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.errors import FlexcalError, InputError
from flexcal.frequency.periodic import half_integer_frequency, odd_lines
from flexcal.model.robot import RobotModel
from flexcal.units import DEGREE

BAND_HZ = (3.0, 80.0)
REFERENCE_HZ = 2.125
"""Approximate frequency of the reference motion."""
EXCITATION = 0.04
"""Largest root mean square of the excitation of an axis in one experiment, relative to its drive's effort."""
DROOP = 2 * DEGREE
"""Largest deviation of an excited axis from its reference, due to gravity under soft position control and to the excitation."""


@dataclass(frozen=True)
class Schedule:
    """Schedule of a pose: `periods` of 1/`base_frequency_hz` s in every recording, the first `settle_periods` of them dropped, and
    `realisations`, each with as many experiments of both signs as axes are excited.
    """

    base_frequency_hz: float = 0.25
    periods: int = 4
    settle_periods: int = 2
    realisations: int = 4


PLAIN = Schedule()
"""Schedule of the paper: 384 s per pose with three axes."""


def flat_multisine(
    model: RobotModel,
    poses: np.ndarray,
    *,
    name: str,
    payload: float | None,
    reference: float,
    seed: int,
    schedule: Schedule = PLAIN,
) -> MultisinePlan:
    """Odd lines from 3 to 80 Hz of equal amplitude on every elastic axis in `poses` (P, n), both signs; Neubauer et al. 2015, §4.1.3, Fig.
    4.

    `reference` (rad) is the amplitude of the slow motion, `payload` in kg, None for the declared. The torque is 4 % of the drives' effort,
    root mean square. Raises `InputError` where robot.yaml declares no elastic joint or no controller.
    """
    if not model.driven:
        raise InputError(
            "E-DESIGN-004",
            f"{model.path} declares no elastic joint, so there is nothing to excite; add `elastic:`.",
        )
    if model.controller is None:
        raise InputError(
            "E-DESIGN-005",
            f"{model.path} declares no controller; add `controller: {{kp: […], kd: […], rate_hz: 4000}}`.",
        )
    lines = odd_lines(schedule.base_frequency_hz, *BAND_HZ)
    joints = tuple(e.index for e in model.driven)
    efforts = np.array([model.joints[i].effort for i in joints])
    if not np.all(np.isfinite(efforts) & (efforts > 0)):
        joint = model.joint_names[joints[int(np.argmin(np.isfinite(efforts) & (efforts > 0)))]]
        raise FlexcalError(
            "E-DESIGN-006",
            f"{model.urdf.name} gives {joint} no positive effort, of which the excitation is a share.",
        )
    amplitude = EXCITATION * efforts * np.sqrt(2 * len(joints) / len(lines))
    return MultisinePlan(
        name=name,
        poses=poses,
        joints=joints,
        payload=payload,
        base_frequency_hz=schedule.base_frequency_hz,
        lines=lines,
        amplitude=np.repeat(amplitude[:, None], len(lines), axis=1),
        periods=schedule.periods,
        settle_periods=schedule.settle_periods,
        realisations=schedule.realisations,
        signs=True,
        reference_amplitude=reference,
        reference_frequency_hz=half_integer_frequency(schedule.base_frequency_hz, REFERENCE_HZ),
        kp=np.array(model.controller.kp),
        kd=np.array(model.controller.kd),
        rate_hz=model.controller.rate_hz,
        torque="held",
        seed=seed,
    )


def excitation_margin(model: RobotModel, reference: float) -> np.ndarray:
    """Free range (n,) rad that a pose needs on either side of every joint: the reference motion and `DROOP` on the excited axes."""
    needed = np.zeros(model.n)
    needed[[e.index for e in model.driven]] = reference + DROOP
    return needed
