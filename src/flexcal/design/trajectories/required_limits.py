"""Requirements of the design of a motion on a model: stated limits and masses, and friction assumed where unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.errors import InputError
from flexcal.model.robot import RobotModel

_NAMED = 3


def require_stated_limits(model: RobotModel) -> None:
    """Raise `InputError` that asks for velocities and efforts missing in the URDF (a 0 counts as missing), and if no link has a mass."""
    for key, unit in (("velocity", "rad/s or m/s"), ("effort", "N m or N")):
        lacking = [joint.name for joint in model.joints if not getattr(joint, key) > 0]
        if lacking:
            raise InputError(
                "E-DESIGN-051",
                f"{model.urdf}: {_listed(lacking)} {'have' if len(lacking) > 1 else 'has'} no limit of {key}, so no motion can be designed "
                f"within it; write `{key}=` ({unit}) of the data sheet into <limit>.",
            )
    if not model.links.mass.any():
        raise InputError(
            "E-DESIGN-052",
            f"{model.urdf}: no link has a mass, so motor torques along a motion are unknown; add <inertial> to the links, even with rough "
            "values.",
        )


def _listed(names: list[str]) -> str:
    if len(names) <= _NAMED:
        return " and ".join(names)
    return f"{', '.join(names[:_NAMED])} and {len(names) - _NAMED} more joints"


COULOMB, VISCOUS = 0.1, 0.2
"""Assumed shares of a joint's effort: Coulomb friction, and viscous friction at the velocity limit."""


def with_assumed_friction(model: RobotModel) -> tuple[RobotModel, tuple[str, ...]]:
    """Model with assumed friction where it has none, and the names of those joints."""
    effort, velocity = np.array([(joint.effort, joint.velocity) for joint in model.joints]).T
    unknown = np.isnan(model.drives.coulomb) | np.isnan(model.drives.viscous)
    filled = replace(
        model,
        drives=replace(
            model.drives,
            coulomb=np.where(np.isnan(model.drives.coulomb), COULOMB * effort, model.drives.coulomb),
            viscous=np.where(
                np.isnan(model.drives.viscous), VISCOUS * effort / velocity, model.drives.viscous
            ),
        ),
    )
    return filled, tuple(name for name, none in zip(model.joint_names, unknown, strict=True) if none)
