"""The next pose, readable from the robot."""

from __future__ import annotations

from functools import lru_cache
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from flexcal.studio.window import joint_unit, paragraph

if TYPE_CHECKING:
    from flexcal.model.parts import Joint
    from flexcal.model.robot import RobotModel
    from flexcal.studio.steps.measure.next_pose import NextPose


def pose_card(model: RobotModel, pose: NextPose, place: str) -> str:
    """HTML of a pose: its number and `place` in the series, and the joint positions as typed at a pendant, in degrees and rad.

    Joint positions are those of the URDF; of prismatic joints mm and m.
    """
    cells = "".join(
        _joint(joint, float(value)) for joint, value in zip(model.motor_joints, pose.q, strict=True)
    )
    payload = "" if pose.payload is None else paragraph(f"payload {pose.payload:g} kg")
    reserve = _reserve(model, pose.q)
    return (
        f'<div data-of="{escape(pose.key, quote=True)}" '
        f'style="margin:0.2em 0.5em;font-size:1.15em;font-weight:700;">Next: pose {pose.number}'
        f'<span style="font-weight:400;font-size:0.75em;opacity:0.8;"> · {escape(place)}</span></div>'
        '<div role="group" aria-label="joint positions of the next pose" style="display:grid;grid-template-columns:1fr 1fr;'
        f'gap:0.1em 0.6em;margin:0 0.5em 0.3em;">{cells}</div>{payload}'
        + (paragraph(reserve, "warning") if reserve else "")
    )


def _reserve(model: RobotModel, q: np.ndarray) -> str:
    """What is not known of a pose (n,) of a robot without collision shapes; empty for others."""
    from flexcal.design.scene import below_base

    is_checked, hangs = _shape(model)
    if is_checked:
        return ""
    below = not hangs and bool(below_base(model, q[None])[0])
    low = " A joint or the point is below the base plane." if below else ""
    return f"Collisions are not checked: the URDF has no collision shapes; move there slowly and look.{low}"


@lru_cache(maxsize=2)
def _shape(model: RobotModel) -> tuple[bool, bool]:
    """Whether a robot has collision shapes, and whether it hangs; asked for every row that comes."""
    from flexcal.design.scene import has_collision_shapes, is_hanging

    shapes = has_collision_shapes(model)
    return shapes, not shapes and is_hanging(model)


def _joint(joint: Joint, value: float) -> str:
    size, unit = joint_unit(joint, "°")
    large = f"{value / size:.3f}".replace("-", "\N{MINUS SIGN}") if np.isfinite(value) else "?"
    small = f"{value:.6f} {'m' if joint.kind == 'prismatic' else 'rad'}"
    return (
        f'<div style="line-height:1.15;"><div style="font-size:0.7em;opacity:0.8;">{escape(joint.name)} · {small}</div>'
        f'<div style="font-size:1.65em;font-weight:600;font-variant-numeric:tabular-nums;white-space:nowrap;">{large}'
        f'<span style="font-size:0.6em;font-weight:400;"> {unit}</span></div></div>'
    )
