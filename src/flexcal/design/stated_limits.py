"""What the design of a motion needs of a URDF: limits of velocity and effort, and masses."""

from __future__ import annotations

from flexcal.errors import InputError
from flexcal.model import RobotModel

_NAMED = 3


def require_stated_limits(model: RobotModel) -> None:
    """Raise `InputError` that asks for the velocities and efforts that the URDF lacks (a 0 says nothing), and where no link has a mass."""
    for key, unit in (("velocity", "rad/s or m/s"), ("effort", "N m or N")):
        lacking = [joint.name for joint in model.joints if not getattr(joint, key) > 0]
        if lacking:
            raise InputError(
                f"{model.urdf}: {_listed(lacking)} {'have' if len(lacking) > 1 else 'has'} no limit of {key}, so no motion can be designed "
                f"within it; write `{key}=` ({unit}) of the data sheet into <limit>."
            )
    if not model.mass.any():
        raise InputError(
            f"{model.urdf}: no link has a mass, so motor torques along a motion are unknown; add <inertial> to the links, even with rough "
            "values."
        )


def _listed(names: list[str]) -> str:
    if len(names) <= _NAMED:
        return " and ".join(names)
    return f"{', '.join(names[:_NAMED])} and {len(names) - _NAMED} more joints"
