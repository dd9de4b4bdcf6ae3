"""Columns of the links' inertials in the torques of an arm with tilting bearings: about every joint, and about the bearings' axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.dynamics.signals import Motion
from flexcal.kernels import Tree
from flexcal.model.kinematics import joint_placement
from flexcal.model.parts import LINK_PARAMETERS, bearing_frame
from flexcal.model.robot import RobotModel

_TURNED = {2: (0, 1, 2), 1: (2, 0, 1), 0: (1, 2, 0)}
"""Axes of the bearing frame in cyclic order, that of the coordinate last."""


class TiltedBearings:
    """The robot's tree with a joint for each tilt of the bearings of `tilting` joints, in the order of Eq. (1).

    `coordinates` are (joint, component) from base to tool: 2 the joint itself, 1 tilt about y, 0 tilt about x.
    """

    def __init__(self, model: RobotModel, tilting: Sequence[int]) -> None:
        self.model, self._tilting = model, tuple(tilting)
        components = {e.index: e.components for e in model.elastic if e.index in self._tilting}
        self.coordinates = [(i, c) for i in range(model.n) for c in components.get(i, (2,))]
        last = {joint: number for number, (joint, _) in enumerate(self.coordinates)}
        self._links = np.concatenate(
            [len(LINK_PARAMETERS) * last[joint] + np.arange(len(LINK_PARAMETERS)) for joint in range(model.n)]
        )
        parents, slides, turns, offsets, normals, frames = [], [], [], [], [], []
        for number, (joint, component) in enumerate(self.coordinates):
            nominal = model.joints[joint]
            first = number == 0 or self.coordinates[number - 1][0] != joint
            offset, turn = joint_placement(model, joint) if first else (np.zeros(3), np.eye(3))
            own = model.springs.bearing_frames.get(joint)
            frame = bearing_frame(nominal) if own is None else own
            parents.append(number - 1 if not first else last[nominal.parent] if nominal.parent >= 0 else -1)
            slides.append(nominal.kind == "prismatic")
            turns.append(turn)
            offsets.append(offset)
            normals.append(nominal.normals)
            frames.append(frame[:, _TURNED[component]])
        self._tree = Tree.build(
            parents, slides, np.array(turns), np.array(offsets), np.array(normals), np.array(frames), False
        )
        self._geometry = np.zeros((len(self.coordinates), 6))
        for number, (joint, component) in enumerate(self.coordinates):
            if component == 2:
                self._geometry[number, 0] = model.geometry.errors[joint, 0]

    def __reduce__(self) -> tuple[type[TiltedBearings], tuple[RobotModel, tuple[int, ...]]]:
        """State for pickling; the kernels' view is rebuilt on arrival."""
        return TiltedBearings, (self.model, self._tilting)

    def felt(self, coordinate: tuple[int, int]) -> np.ndarray:
        """Numbers of the inertials, of all links, that act on a coordinate: those of the links beyond its joint."""
        beyond = [link for link in range(self.model.n) if coordinate[0] in self.model.path_to(link)]
        return np.concatenate(
            [len(LINK_PARAMETERS) * link + np.arange(len(LINK_PARAMETERS)) for link in beyond]
        )

    def write(
        self,
        states: tuple[np.ndarray, np.ndarray, np.ndarray],
        motion: Motion,
        places: np.ndarray,
        out: np.ndarray,
    ) -> None:
        """Write the column c of coordinate k to row `places`[k, c] of `out` (rows, N); -1 for those not needed.

        `states` are the links' q, q̇, q̈ (N, n); the tilts are those of the motion's arm side.
        """
        q, dq, ddq = (self._whole(values, motion, order) for order, values in enumerate(states))
        wide = np.full((len(self.coordinates), len(LINK_PARAMETERS) * len(self.coordinates)), -1)
        wide[:, self._links] = places
        self._tree.torque_regressor(self._geometry, self.model.gravity, q, dq, ddq, wide, out)

    def _whole(self, values: np.ndarray, motion: Motion, order: int) -> np.ndarray:
        coordinates = np.empty((len(values), len(self.coordinates)))
        for number, (joint, component) in enumerate(self.coordinates):
            coordinates[:, number] = (
                values[:, joint] if component == 2 else motion.tilt(component, order)[:, joint]
            )
        return coordinates
