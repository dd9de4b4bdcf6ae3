"""Robots with known errors to export."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

from flexcal.export.urdf import render_urdf
from flexcal.model.robot import GEOMETRY, RobotModel

Kinematics = Callable[[np.ndarray], np.ndarray]


@pytest.fixture
def erroneous() -> Callable[[RobotModel, float], RobotModel]:
    """A robot with a random error of every geometric parameter, rad and m."""

    def make(model: RobotModel, size: float = 1e-3) -> RobotModel:
        rng = np.random.default_rng(7)
        owners = [*model.joint_names, "tool"]
        return model.with_values({f"{o}.{key}": size * rng.normal() for o in owners for key in GEOMETRY})

    return make


@pytest.fixture
def pinocchio_of() -> Callable[[RobotModel], Kinematics]:
    """Frames (N, 4, 4) of the first point of a robot, by Pinocchio from a URDF with its geometry."""

    def make(model: RobotModel) -> Kinematics:
        read = pin.buildModelFromXML(render_urdf(model).text)
        data, frame = read.createData(), read.getFrameId(model.point().name)

        def frames(q: np.ndarray) -> np.ndarray:
            result = []
            for own in q:
                pin.framesForwardKinematics(read, data, own)
                result.append(data.oMf[frame].homogeneous.copy())
            return np.array(result)

        return frames

    return make
