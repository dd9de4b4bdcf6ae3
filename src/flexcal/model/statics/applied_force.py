"""Deflection of the resting arm by a known force at the measured point, as of a wire that pulls at the tool."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexcal.model.kinematics import PointKinematics
from flexcal.model.robot import RobotModel
from flexcal.model.statics.equilibrium import Equilibrium, lateral_axes


def force_moments(kinematics: PointKinematics, force: np.ndarray) -> np.ndarray:
    """Moments (N, n, 3), N m, of a force (N, 3), N in the base frame, at the point: about tilt x, tilt y and the axis of every joint.

    They work on the motion of the arm beyond the joint: Jᵀ f.
    """
    return np.einsum("nxjc,nx->njc", kinematics.motion_jacobian[:, :3], force)


def under_force(model: RobotModel, q: np.ndarray, rest: Equilibrium, moments: np.ndarray) -> Equilibrium:
    """Equilibrium under gravity `rest`, with its compliance, under further `moments` (N, n, 3) too: to first order in what these deflect.

    What the deflection changes in the moments is some 1e-3 of them. Springs that harden count with their stiffness under gravity.
    """
    deflection = rest.deflection.copy()
    if len(rest.axes):
        joints, components = rest.axes.T
        bent = np.matmul(rest.compliance, moments[:, joints, components][:, :, None])[:, :, 0]
        deflection[:, joints, components] += bent
    deflection[:, :, 2] += model.geometry.gravity_compliance * moments[:, :, 2]
    lateral = model.geometry.lateral_compliance
    if lateral.any():
        axes = lateral_axes(model, q)
        along = np.matmul(axes, moments[:, :, :2, None])[:, :, :, 0]
        deflection[:, :, :2] += np.einsum("njk,njkc->njc", lateral * along, axes)
    return replace(rest, deflection=deflection, torque=rest.torque - moments[:, :, 2])
