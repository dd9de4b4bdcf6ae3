"""Drive springs of joints that robot.yaml declares rigid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from flexcal.errors import FlexcalError
from flexcal.model.loading import bearing_frame, kinematic_tree
from flexcal.model.robot_model import RobotModel


def with_drive_springs(model: RobotModel, springs: Mapping[int, tuple[float, float]]) -> RobotModel:
    """`model` with a drive spring, (stiffness in N m/rad, damping in N m s/rad), at each of some rigid joints, by index.

    In a frequency experiment the motors of these joints are braked. Raises `FlexcalError` for a prismatic joint.
    """
    frames, stiffness, damping = dict(model.bearing_frames), model.stiffness.copy(), model.damping.copy()
    for i, (constant, loss) in springs.items():
        joint = model.joints[i]
        if joint.kind != "revolute":
            raise FlexcalError(f"the joint '{joint.name}' is prismatic; only revolute joints can be elastic.")
        frames[i] = bearing_frame(joint)
        stiffness[i, 2], damping[i, 2] = constant, loss
    return replace(
        model,
        bearing_frames=frames,
        tree=kinematic_tree(model.joints, frames, model.config.bearings),
        stiffness=stiffness,
        damping=damping,
        braked=model.braked | set(springs),
    )


def with_estimated_springs(model: RobotModel, values: Mapping[str, float]) -> RobotModel:
    """`model` with a drive spring at every rigid joint whose `<joint>.drive.stiffness` is among `values`."""
    springs = {}
    for i, name in enumerate(model.joint_names):
        stiffness = values.get(f"{name}.drive.stiffness")
        if stiffness is not None and i not in model.bearing_frames:
            springs[i] = (stiffness, values.get(f"{name}.drive.damping", 0.0))
    return with_drive_springs(model, springs) if springs else model


def with_brakes(model: RobotModel, excited: tuple[str, ...]) -> RobotModel:
    """`model` in a frequency experiment that excites the named joints: the motors of all other elastic joints are braked."""
    return replace(model, braked=frozenset(e.index for e in model.elastic if e.name not in excited))
