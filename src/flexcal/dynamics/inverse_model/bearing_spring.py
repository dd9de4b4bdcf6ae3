"""Torques of a bearing's two springs and their columns, in the equations of the tilts of an elastic joint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexcal.dynamics.inverse_model.drive_terms import Column
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import SPRINGS, RobotModel


@dataclass(frozen=True)
class BearingSpring:
    """Spring of the `joint` (its number) against tilt about x (`component` 0) or y (1).

    Its equation is that of the links about the tilt's axis, + `<joint>.bearing_x.stiffness` q_x + `.damping` q̇_x
    + `.torque_offset` = 0: nobody drives a bearing. The offset is what the tilt's zero is off, times the stiffness.
    """

    joint: int
    component: int

    def name(self, model: RobotModel) -> str:
        """Prefix of its parameters: `joint_1.bearing_x`."""
        return f"{model.joint_names[self.joint]}.{SPRINGS[self.component]}"

    def columns(self, model: RobotModel, motion: Motion, equation: int) -> Iterator[Column]:
        """Columns of the spring; `equation` is the number of the tilt's. Raises `FlexcalError` for a motion without tilts."""
        name = self.name(model)
        tilt, rate = (motion.tilt(self.component, order)[:, self.joint] for order in (0, 1))
        yield Column(f"{name}.stiffness", equation, tilt)
        yield Column(f"{name}.damping", equation, rate)
        yield Column(f"{name}.torque_offset", equation, np.ones_like(tilt))
