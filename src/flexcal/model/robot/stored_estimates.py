"""Application of stored estimates to a robot."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from flexcal.errors import InputError
from flexcal.estimation import Estimate
from flexcal.files.formats import Block, read_estimates
from flexcal.model.parts import Bearings, is_physically_consistent
from flexcal.model.robot.attached_payload import with_payload
from flexcal.model.robot.parameter_names import DRIVE_GAIN, unit_in, unit_of

if TYPE_CHECKING:
    from flexcal.model.robot.robot_model import RobotModel

TARGETS = "option.targets"
"""Provenance key of the block `calibration`: the measured points."""
READINGS = "option.readings"
"""Provenance key of the block `calibration`: the kinds of measurements."""
TARGETS_BETWEEN = ", "
PAYLOAD_FRAME = "frame"
"""Provenance key of the block `payload`: the URDF frame of its values."""
BEARINGS = "option.bearings"
"""Provenance key of the blocks `stiffness` and `calibration`: the bearings assumed in the identification."""
NUISANCE = re.compile(
    r".*\.(pose_[0-9]+|half_gap|slip_share|slip_twist|held_inertia|arm_inertia|arm_viscous|arm_coulomb|(drive|bearing_x|bearing_y)\.torque_offset"
    r"|drive\.gap_torque|drive\.(stiffness|damping)_at_.+)|force_sensor\.[fm][xyz]_offset"
    r"|sensor\..+\.(sensitivity|delay|position_[xyz]|direction_[12])"
)
"""Names of nuisance parameters: estimated for one experiment, or separable only by the flexible model; not applied to the robot."""


DECLARED = "declared"
"""Provenance key: SHA-256 of the numbers of the robot as declared, from which a block was computed."""


def declared_sha256(nominal: RobotModel, points: Iterable[str] | None = None) -> str:
    """SHA-256 of the numbers of a robot without estimates to which its estimates are relative: joints, springs, masses, gravity, and
    those `points` that were measured, by default all; others may come and go.
    """
    measured = frozenset(nominal.points if points is None else points)
    digest = hashlib.sha256()
    for joint in nominal.joints:
        digest.update(f"{joint.name} {joint.link} {joint.parent} {joint.kind}".encode())
        for array in (joint.rotation, joint.translation, joint.axis):
            digest.update(_rounded(array))
    for name, point in sorted(nominal.points.items()):
        if name not in measured:
            continue
        digest.update(f"{name} {point.joint}".encode())
        for array in (point.rotation, point.translation, point.xyz):
            digest.update(_rounded(array))
    for name, value in sorted(nominal.values.items()):
        owner = name.rpartition(".")[0]
        if owner.startswith("point.") and owner.removeprefix("point.") not in measured:
            continue
        if not name.startswith("station.") and not name.endswith(f".{DRIVE_GAIN}"):  # none is declared
            digest.update(name.encode() + _rounded(np.array(value)))
    digest.update(_rounded(np.array(nominal.config.gravity, dtype=float)))
    return digest.hexdigest()


def _rounded(values: np.ndarray) -> bytes:
    """Ten digits or 1e-10, the less: the same on other processors."""
    return ",".join(f"{round(float(value), 10) + 0.0:.10g}" for value in np.ravel(values)).encode()


def apply_estimates(model: RobotModel, path: Path, *, without: Block | None = None) -> RobotModel:
    """Robot with every block of an estimates file except `without`, applied in order; raises `InputError` as `with_blocks` does."""
    return with_blocks(model, read_estimates(path, without=without), path)


def with_blocks(model: RobotModel, blocks: Mapping[Block, Estimate], path: Path) -> RobotModel:
    """Robot with the estimates of `blocks`, read from the file `path`.

    The block `actuators` is of simulators, and no part of the robot.

    A joint whose backlash was estimated counts as declared to have backlash, one whose drive stiffness was estimated as elastic, and a
    payload that was identified as declared in its frame; places of a fixture with sockets are stations.
    Raises `InputError` for a unit that is not the parameter's; for a name that the robot does not have: the file is then of another
    robot, or robot.yaml has changed since; where robot.yaml declares the payload in another frame; and for an elastic robot where
    `dynamics` has links that no body can be, as linear least squares may: they give the right torques at the joints, and wrong ones
    everywhere else. Bearings that robot.yaml does not declare are those of the blocks; raises too where they are others than declared, or
    not the same in all blocks.
    """
    model = _with_bearings(model, blocks, path)
    if "payload" in blocks:
        model = _with_payload(model, blocks["payload"], path)
    for block, estimate in blocks.items():
        if block == "actuators":
            continue
        model = model.with_estimated_springs(estimate.values)
        if model.config.measurements:
            model = model.with_stations(
                n.removeprefix("station.").rpartition(".")[0]
                for n in estimate.parameters.names
                if n.startswith("station.")
            )
        cameras = [
            n.split(".")[1]
            for n in estimate.parameters.names
            if n.startswith("camera.") and n.endswith(".fx")
        ]
        model = model.with_lenses({name: np.zeros(9) for name in cameras})
        unknown = [
            n for n in estimate.parameters.names if n not in model.values and not NUISANCE.fullmatch(n)
        ]
        if unknown:
            raise InputError(
                "E-ROBOT-045",
                f"{path}: the block '{block}' has '{unknown[0]}', which the robot of {model.path} does not have; "
                "identify again, or give the robot.yaml that belongs to it.",
            )
        _check_units(model, block, estimate, path)
        if block == "calibration":
            model = _with_tool_point(model, estimate, path)
        model = _with_backlash_joints(model.with_estimate(estimate), estimate)
        if block == "dynamics" and model.elastic:
            _check_bodies(model, estimate, path)
    return model


def _check_units(model: RobotModel, block: Block, estimate: Estimate, path: Path) -> None:
    for parameter in estimate.parameters:
        units = (unit_in(model, parameter.name), unit_of(parameter.name))
        if parameter.name in model.values and parameter.unit not in units:
            raise InputError(
                "E-ROBOT-046",
                f"{path}: the block '{block}' has '{parameter.name}' in '{parameter.unit}', not in {units[0]}; identify again.",
            )


def _with_bearings(model: RobotModel, blocks: Mapping[Block, Estimate], path: Path) -> RobotModel:
    for block, estimate in blocks.items():
        if BEARINGS not in estimate.provenance:
            continue
        bearings = cast(Bearings, estimate.provenance[BEARINGS])
        if model.config.bearings is None:
            model = model.with_bearings(bearings)
        elif model.bearings != bearings:
            again = "calibrate" if block == "calibration" else f"identify {block}"
            raise InputError(
                "E-ROBOT-047",
                f"{path}: the block '{block}' was estimated with `bearings: {bearings}`, but the robot has `bearings: {model.bearings}` "
                f"by {model.path} or by another block; run 'flexcal {again}' again.",
            )
    return model


def _with_payload(model: RobotModel, estimate: Estimate, path: Path) -> RobotModel:
    """Robot with the frame of the identified payload; its values come with its block."""
    frame, declared = estimate.provenance.get(PAYLOAD_FRAME, ""), model.payload
    if declared is None:
        values = estimate.values
        com = np.array([values[f"payload.com_{key}"] for key in "xyz"])
        return with_payload(model, frame, values["payload.mass"], com, np.zeros((3, 3)))
    if declared.frame != frame:
        raise InputError(
            "E-ROBOT-048",
            f"{path}: the payload was identified in the frame '{frame}', but {model.path} declares it in '{declared.frame}'; run "
            "'flexcal identify payload' again, or correct the frame.",
        )
    return model


def _check_bodies(model: RobotModel, estimate: Estimate, path: Path) -> None:
    links = [joint.link for joint in model.joints if f"{joint.link}.mc_x" in estimate.parameters]
    broken = [link for link in links if not is_physically_consistent(estimate.values, link)]
    if broken:
        raise InputError(
            "E-ROBOT-049",
            f"{path}: the inertials in the block 'dynamics' are not physically consistent for {', '.join(broken)}, as elastic "
            "joints require; run 'flexcal identify dynamics' with --estimator sdp.",
        )


def _with_tool_point(model: RobotModel, estimate: Estimate, path: Path) -> RobotModel:
    """Robot whose errors `tool.length_x`… are those of the point that was the first when it was calibrated."""
    if not any(name.startswith("tool.length") for name in estimate.parameters.names):
        return model
    told = [name for name in estimate.provenance.get(TARGETS, "").split(TARGETS_BETWEEN) if name]
    inclined = {name for name, item in model.config.measurements.items() if item.kind == "inclinometer"}
    own = [name for name in told if f"point.{name}.x" not in estimate.parameters and name not in inclined]
    if not own or next(iter(model.points), "") in own:
        return model
    if own[0] not in model.points:
        raise InputError(
            "E-ROBOT-084",
            f"{path}: the calibration measured the point '{own[0]}', which {model.path} does not declare, so where the tool is relative to "
            "it is not known; add it under `points:` as it was, or calibrate again.",
        )
    return replace(model, geometry=replace(model.geometry, tool_point=own[0]))


def _with_backlash_joints(model: RobotModel, estimate: Estimate) -> RobotModel:
    declared = set(model.config.geometry.backlash)
    estimated = [name for name in model.joint_names if f"{name}.backlash" in estimate.parameters]
    if declared.issuperset(estimated):
        return model
    joints = tuple(name for name in model.joint_names if name in declared.union(estimated))
    geometry = replace(model.config.geometry, backlash=joints)
    return replace(model, config=replace(model.config, geometry=geometry))
