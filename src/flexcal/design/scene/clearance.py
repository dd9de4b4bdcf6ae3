"""Clearance of a robot's bodies along a motion, and its derivatives by the joints, from coal's witness points."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexcal.design.scene.collision import CollisionChecker


class Clearance:
    """Distances, less margins and `beyond`, of all pairs of shapes compared by a checker, where below `within`, m.

    What is farther is not computed again until the joints have moved so much that it could be near: no point of a body moves farther
    than its distance from the axis times the angle.
    """

    def __init__(self, checker: CollisionChecker, within: float, beyond: float = 0.0) -> None:
        self.checker, self.within, self.beyond = checker, within, beyond
        self._robot, self._geometry = checker.kinematics, checker.geometry
        self._data: Any = self._robot.createData()
        self._distances: Any = self._geometry.createData()
        places = [self._robot.getJointId(name) for name in checker.model.joint_names]
        self._columns = [self._robot.joints[place].idx_v for place in places]
        self._margins = checker.margins + beyond
        moves = np.array(
            [
                [place in self._robot.supports[o.parentJoint] for place in places]
                for o in self._geometry.geometryObjects
            ]
        )
        ends = np.array([(p.first, p.second) for p in self._geometry.collisionPairs], dtype=int).reshape(
            -1, 2
        )
        self._first, self._second = moves[ends[:, 0]], moves[ends[:, 1]]
        self._reach = (self._first != self._second) * _reaches(checker)
        self._distance, self._where = np.zeros((0, 0)), np.zeros((0, 0, 0))

    @property
    def compares(self) -> bool:
        """Whether there are shapes that could collide: a URDF may have none."""
        return len(self._reach) > 0

    def wider(self, further: float) -> Clearance:
        """Clearance with margins larger by `further`, m, and an empty cache."""
        return Clearance(self.checker, self.within, self.beyond + further)

    def near(self, q: np.ndarray, least: float = -np.inf) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Instants (k,), distances (k,), negative inside the margin, and derivatives (k, n) by the joints, of pairs below `within`.

        `q` (N, n). Nothing more is looked at once a distance is below `least`. A derivative is along the line between the nearest
        points; it jumps where these do.
        """
        import pinocchio as pin

        if len(self._distance) != len(q):
            self._distance = np.full((len(q), len(self._reach)), -np.inf)
            self._where = np.zeros((len(q), *self._reach.shape))
        moved = np.einsum("ipj,pj->ip", np.abs(q[:, None] - self._where), self._reach)
        perhaps = self._distance - moved < self.within
        robot, data, geometry, distances = self._robot, self._data, self._geometry, self._distances
        close: list[tuple[int, int]] = []
        points: list[np.ndarray] = []
        jacobians: list[np.ndarray] = []
        configurations = self.checker.configurations(q)
        for i in np.flatnonzero(perhaps.any(axis=1)).tolist():
            pairs = np.flatnonzero(perhaps[i])
            pin.updateGeometryPlacements(robot, data, geometry, distances, configurations[i])
            least_distances = np.array(
                [pin.computeDistance(geometry, distances, pair).min_distance for pair in pairs.tolist()]
            )
            least_distances -= self._margins[pairs]
            self._distance[i, pairs], self._where[i, pairs] = least_distances, q[i]
            within = pairs[least_distances < self.within].tolist()
            if within:
                jacobian = pin.computeJointJacobians(robot, data, configurations[i])[:, self._columns]
                jacobians += [jacobian] * len(within)
            for pair in within:
                result = distances.distanceResults[pair]
                close.append((i, pair))
                points.append(np.array([result.getNearestPoint1(), result.getNearestPoint2(), result.normal]))
            if least_distances.min(initial=np.inf) < least:
                break
        instants, pairs = np.array(close, dtype=int).reshape(-1, 2).T
        one, other, normal = np.array(points).reshape(-1, 3, 3).transpose(1, 0, 2)
        moving = np.array(jacobians).reshape(len(close), 6, q.shape[1])
        slopes = np.zeros((len(close), q.shape[1]))
        for point, carried, sign in ((one, self._first, -1.0), (other, self._second, 1.0)):
            turning = np.einsum("kc,kcj->kj", np.cross(point, normal), moving[:, 3:])
            slopes += sign * carried[pairs] * (np.einsum("kc,kcj->kj", normal, moving[:, :3]) + turning)
        return instants, self._distance[instants, pairs], slopes


def _reaches(checker: CollisionChecker) -> np.ndarray:
    """Largest distance (n,) of a joint's bodies from its axis, m; 1 for a prismatic joint, whose bodies move by its displacement."""
    joints = checker.model.joints
    reach = np.zeros(len(joints))
    for shape in checker.shapes:
        geometry = shape.geometry
        geometry.computeLocalAABB()
        far = np.linalg.norm(shape.translation) + np.linalg.norm(geometry.aabb_center) + geometry.aabb_radius
        for at in reversed(checker.model.path_to(shape.joint)):
            reach[at] = max(reach[at], far)
            travel = (
                max(abs(joints[at].lower), abs(joints[at].upper)) if joints[at].kind == "prismatic" else 0.0
            )
            far += np.linalg.norm(joints[at].translation) + travel
    return np.where([joint.kind == "prismatic" for joint in joints], 1.0, reach)
