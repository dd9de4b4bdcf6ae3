"""Structural identifiability of the geometry: rank of the kinematic Jacobian, on the measured poses and on random ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.calibration.fit.terms import coordinates, manufacturing_tolerances
from flexcal.calibration.measurement import predict_measurements
from flexcal.data.poses import PoseSet
from flexcal.errors import FlexcalError
from flexcal.estimation import Identifiability, Parameters, analyse
from flexcal.model.kinematics import random_configurations
from flexcal.model.robot import RobotModel

_RANDOM_POSES = 100


def kinematic_identifiability(
    model: RobotModel,
    poses: PoseSet,
    parameters: Parameters,
    *,
    scale: np.ndarray | None = None,
    prefer: Sequence[str] = (),
) -> Identifiability:
    """Rank at zero deflection with the flanks unchanged: exact derivatives leave a gap of many decades.

    `scale` (p,) is the size of a change that matters, tolerances of manufacture by default: larger columns are kept first.
    """
    straight = predict_measurements(model, poses, elastic=False, jacobians=True)
    columns = straight.jacobian(parameters.names).reshape(-1, len(parameters))
    preferred = [name for name in parameters.names if name.endswith("backlash")]
    # how a target's axes are mounted is to take up a rotation of the tool, or an offset of the last joint
    preferred += [
        name for name in parameters.names if name.startswith("point.") and name.endswith(("rx", "ry", "rz"))
    ]
    if not poses.located.any():
        # where fixture, wire or face stand is to take up what moves the whole robot, not a joint
        preferred += [name for name in parameters.names if name.startswith("station.")]
    preferred += prefer
    if np.isfinite(parameters.prior_std()).any():
        # a declared prior must not stand against what the points tell of a parameter without
        preferred += [item.name for item in parameters if not np.isfinite(item.prior_std)]
    return analyse(
        columns,
        parameters.names,
        scale=manufacturing_tolerances(parameters) if scale is None else scale,
        prefer=preferred,
    )


def random_identifiability(
    model: RobotModel,
    poses: PoseSet,
    parameters: Parameters,
    seen: Identifiability,
    *,
    scale: np.ndarray | None = None,
) -> Identifiability:
    """Rank on random poses over the whole joint ranges, with the parameters kept in `seen` ordered first."""
    limits = np.array([(max(j.lower, -np.pi), min(j.upper, np.pi)) for j in model.motor_joints])
    count = max(_RANDOM_POSES, len(parameters))
    many = poses.subset(np.linspace(0, len(poses) - 1, count).astype(int))
    spread = random_configurations(model, count, np.random.default_rng(0), limits[:, 0], limits[:, 1])
    return kinematic_identifiability(
        model, replace(many, q=spread), parameters, scale=scale, prefer=seen.kept_names
    )


def require_enough(
    model: RobotModel, poses: PoseSet, parameters: Parameters, identifiability: Identifiability
) -> None:
    """Raise `FlexcalError` if there are too few rows for the parameters that many random poses would determine."""
    rows = coordinates(poses)
    if identifiability.rank < rows:
        return
    rank = random_identifiability(model, poses, parameters, identifiability).rank
    raise FlexcalError(
        "E-CAL-009",
        f"{len(poses)} poses give {rows} coordinates, too few for {rank} identifiable parameters; "
        f"measure at least {rank * len(poses) // rows + 1} poses, better three times as many.",
    )
