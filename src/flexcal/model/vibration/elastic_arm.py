"""Elastic arm as a Pinocchio model: every elastic joint is three revolutes, twist, tilt about y, tilt about x (Eq. 1).

Where the bearings are fixed to the parent link the two tilts come first.
"""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from flexcal.model.kinematics import joint_placement
from flexcal.model.parts import Inertia, bearing_frame
from flexcal.model.robot import SPRINGS, RobotModel
from flexcal.model.statics import elastic_axes


class ElasticArm:
    """Robot with a payload mass (kg) in Pinocchio; the arm's own coordinates follow the drives.

    `elastic` (d,) are the velocity indices of the elastic coordinates in the order of `elastic_axes`; `model` and `data` are
    Pinocchio's. Inertias can be exchanged (`set_inertia`), which is what derivatives with respect to them need.
    """

    def __init__(self, robot: RobotModel, payload: float | None = None) -> None:
        import pinocchio as pin

        robot.require_motors("vibration")
        self._carry(robot, payload)
        self.model: Any = pin.Model()
        self.model.gravity = pin.Motion(robot.gravity, np.zeros(3))
        self.bodies: list[int] = []
        self.turns: list[np.ndarray] = []
        added: dict[tuple[int, int], int] = {}
        components = {e.index: e.components for e in robot.elastic}
        for i, joint in enumerate(robot.joints):
            frame = robot.springs.bearing_frames.get(i)
            frame = bearing_frame(joint) if frame is None else frame
            position, aligned = joint_placement(robot, i)
            placement = pin.SE3(aligned @ frame, position)
            if joint.parent >= 0:
                placement = pin.SE3(self.turns[joint.parent].T, np.zeros(3)) * placement
            body = self.bodies[joint.parent] if joint.parent >= 0 else 0
            motion = pin.JointModelPZ() if joint.kind == "prismatic" else pin.JointModelRZ()
            kinds = (pin.JointModelRX(), pin.JointModelRY(), motion)
            for c in components.get(i, (2,)):
                name = joint.name if c == 2 else f"{joint.name}.{SPRINGS[c]}"
                body = self.model.addJoint(body, kinds[c], placement, name)
                added[i, c] = body
                placement = pin.SE3.Identity()
            self.bodies.append(body)
            self.turns.append(frame)
            self.set_inertia(i, robot.inertias[i])
        self.data: Any = self.model.createData()
        axes = elastic_axes(robot)
        self._springs, self._units = [added[axis] for axis in axes], [component for _, component in axes]
        idx_v = list(self.model.idx_vs)
        self.joint_velocity = np.array([idx_v[added[i, 2]] for i in range(robot.n)])
        self.elastic = np.array([idx_v[spring] for spring in self._springs], dtype=int)
        self._block = np.ix_(self.elastic, self.elastic)
        self._upper = np.minimum(*self._block), np.maximum(*self._block)

    def with_inertials(self, robot: RobotModel, payload: float | None = None) -> ElasticArm:
        """Arm of another robot with a payload mass (kg): this one with other inertias, where the robots differ in nothing else of it."""
        before = self.robot
        same = (
            robot.joints is before.joints
            and robot.config is before.config
            and robot.geometry is before.geometry
            and robot.springs.bearing_frames is before.springs.bearing_frames
            and elastic_axes(robot) == elastic_axes(before)
        )
        if not same:
            return ElasticArm(robot, payload)
        arm = copy(self)
        arm._carry(robot, payload)
        arm.model = self.model.copy()
        for i, link in enumerate(robot.inertias):
            arm.set_inertia(i, link)
        arm.data = arm.model.createData()
        return arm

    def _carry(self, robot: RobotModel, payload: float | None) -> None:
        self.robot = robot
        self.payload = robot.payload_mass if payload is None else float(payload)
        hung = robot.payload
        self._payload_joint = -1 if hung is None else hung.joint
        self._carried = None if hung is None or self.payload <= 0 else hung.carried(self.payload)

    def set_inertia(self, joint: int, link: Inertia, carried: Inertia | None = None) -> None:
        """Set the inertia of a joint's link; the payload, or the `carried` one, is added where the link carries it."""
        import pinocchio as pin

        total = _pinocchio_inertia(link)
        carried = self._carried if carried is None else carried
        if joint == self._payload_joint and carried is not None:
            total = total + _pinocchio_inertia(carried)
        self.model.inertias[self.bodies[joint]] = pin.SE3(self.turns[joint].T, np.zeros(3)).act(total)

    def configuration(self, q: np.ndarray, deflection: np.ndarray) -> np.ndarray:
        """Pinocchio's configuration (nq,) of motors at `q` (n,) and the arm deflected by `deflection` (n, 3)."""
        result = np.zeros(self.model.nq)
        result[self.joint_velocity] = q + self.robot.geometry.errors[:, 0] + deflection[:, 2]
        for at, (joint, component) in zip(self.elastic, elastic_axes(self.robot), strict=True):
            if component != 2:
                result[at] = deflection[joint, component]
        return result

    def mass_matrix(self, configuration: np.ndarray) -> np.ndarray:
        """Mass matrix (d, d) of the elastic coordinates, kg m²."""
        import pinocchio as pin

        return pin.crba(self.model, self.data, configuration)[
            self._upper
        ]  # below the diagonal it is not filled

    def gravity_stiffness(self, configuration: np.ndarray) -> np.ndarray:
        """Gravity stiffness ∂g/∂q (d, d) of the elastic coordinates, N m/rad."""
        import pinocchio as pin

        return pin.computeGeneralizedGravityDerivatives(self.model, self.data, configuration)[self._block]

    def mass_matrix_derivatives(self, configuration: np.ndarray) -> np.ndarray:
        """∂M/∂q (d, d, d): the last index is the elastic coordinate that moves."""
        import pinocchio as pin

        rest = np.zeros(self.model.nv)
        weight = np.array(pin.computeGeneralizedGravityDerivatives(self.model, self.data, configuration))
        columns = []
        for at in self.elastic:
            push = rest.copy()
            push[at] = 1.0
            by_q = pin.computeRNEADerivatives(self.model, self.data, configuration, rest, push)[0]
            columns.append((np.array(by_q) - weight)[self._block])
        return np.stack(columns, axis=1)

    def gravity_stiffness_derivatives(self, configuration: np.ndarray) -> np.ndarray:
        """∂²g/∂q² (d, d, d): for k before j before l it is -gᵀ(a_k × (a_j × (a_l × S_l))), S_l the first moment beyond l."""
        import pinocchio as pin

        pin.centerOfMass(self.model, self.data, configuration, True)
        d = len(self.elastic)
        axes, moments = np.empty((d, 3)), np.empty((d, 3))
        for k, (joint, unit) in enumerate(zip(self._springs, self._units, strict=True)):
            placement = self.data.oMi[joint]
            axes[k] = placement.rotation[:, unit]
            moments[k] = self.data.mass[joint] * (placement.rotation @ self.data.com[joint])
        twice = np.cross(axes[:, None], np.cross(axes, moments))
        chained = -np.einsum("kx,mlx->kml", np.cross(self.robot.gravity, axes), twice)
        supports = [set(self.model.supports[far]) for far in self._springs]
        carries = np.array([[near in supporting for supporting in supports] for near in self._springs])
        chained *= carries[:, :, None] & carries[None]
        near, middle, far = np.sort(np.indices((d, d, d)), axis=0)
        return chained[near, middle, far]

    def place(self, configuration: np.ndarray, joint: int, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position of the point `xyz` (3,) m of a joint's link in the base frame, and the link's orientation (3, 3)."""
        import pinocchio as pin

        pin.forwardKinematics(self.model, self.data, configuration)
        placement = self.data.oMi[self.bodies[joint]]
        turn = placement.rotation @ self.turns[joint].T
        return placement.translation + turn @ xyz, turn

    def elastic_axes_at(self, joint: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Origins (d, 3) m and axes (d, 3) of the elastic coordinates after `place`, base frame, and which carry a joint's link (d,)."""
        placements = [self.data.oMi[i] for i in self._springs]
        axes = np.array([p.rotation[:, unit] for p, unit in zip(placements, self._units, strict=True)])
        carrying = set(self.model.supports[self.bodies[joint]])
        return (
            np.array([p.translation for p in placements]),
            axes,
            np.array([i in carrying for i in self._springs]),
        )

    def nearer(self) -> np.ndarray:
        """Mask (d, d) of pairs whose elastic coordinate k is at or nearer to the base than l, for coordinates of one branch."""
        ids = np.array(self._springs)
        return ids[:, None] <= ids[None, :]


def _pinocchio_inertia(body: Inertia) -> Any:
    import pinocchio as pin

    return pin.Inertia(body.mass, body.com, body.inertia)


def moved_inertia(link: Inertia, mass: float, com: np.ndarray) -> Inertia:
    """Link with another mass and centre of mass; the inertia about the centre of mass scales with the mass."""
    scale = mass / link.mass if link.mass > 0 else 1.0
    return Inertia(mass, com, link.inertia * scale)
