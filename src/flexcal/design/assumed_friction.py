"""Friction that is assumed of joints of which none is known, so that a design leaves room for it in the motor torques."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.model import RobotModel

COULOMB, VISCOUS = 0.1, 0.2
"""Shares of a joint's effort: Coulomb friction, and viscous friction at the velocity limit"""


def with_assumed_friction(model: RobotModel) -> tuple[RobotModel, tuple[str, ...]]:
    """The model with these values where it has none, and the names of those joints."""
    effort, velocity = np.array([(joint.effort, joint.velocity) for joint in model.joints]).T
    unknown = np.isnan(model.coulomb) | np.isnan(model.viscous)
    filled = replace(
        model,
        coulomb=np.where(np.isnan(model.coulomb), COULOMB * effort, model.coulomb),
        viscous=np.where(np.isnan(model.viscous), VISCOUS * effort / velocity, model.viscous),
    )
    return filled, tuple(name for name, none in zip(model.joint_names, unknown, strict=True) if none)
