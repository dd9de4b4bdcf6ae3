"""Collision of the robot with itself, the floor and obstacles: coal on the collision shapes of the URDF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.errors import InputError
from flexcal.model.kinematics import (
    joint_batch,
    joint_positions,
    low_discrepancy_configurations,
    point_kinematics,
)
from flexcal.model.robot import RobotModel
from flexcal.model.urdf import (
    locked_joints,
    pinocchio_model,
    pinocchio_model_of,
    pinocchio_shapes,
    read_elements,
)

_SAMPLES = 200
_FLOOR = "floor"
_STANDING = 0.1
"""Share of configurations with the target above the floor, below which the robot hangs."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A collision shape (coal) at `rotation` (3, 3), `translation` (3,) in the link of joint `joint` (-1: it does not move)."""

    name: str
    geometry: Any
    joint: int
    rotation: np.ndarray
    translation: np.ndarray


class CollisionChecker:
    """Collision of the nominal robot with itself, with `floor` and with the obstacles that robot.yaml declares.

    `margin` (m): bodies nearer than this count as touching. `floor` is the height (m, along z of the base frame) below which nothing
    but the base and the first link may reach: the surface on which the robot stands; None for no such surface, as for a robot that
    hangs: one whose target is above it in hardly any configuration. Shapes of one link (those on fixed and locked joints belong to
    the link that carries them) and of neighbouring links are never compared. Nor are pairs that overlap in each of 200 configurations
    spread evenly over the joint ranges: their shapes are drawn too large; `permanent` names them. Pairs that never come apart by the
    margin, as in a compact wrist, are compared without it. A mesh counts as its convex hull; `package://name/` is looked for in every
    folder above the URDF. A payload, the reflector's mount and cables have no shape and are not seen. Without collision shapes in the
    URDF nothing collides. `kinematics` and `geometry` are Pinocchio's. Raises `InputError` where shapes or obstacles cannot be read,
    and for an obstacle that a link touches in each of the 200 configurations.
    """

    def __init__(self, model: RobotModel, *, margin: float = 0.01, floor: float | None = 0.0) -> None:
        import coal
        import pinocchio as pin

        self.model = model
        self.margin = margin
        self.floor = None if floor is None or is_hanging(model, floor) else floor
        _, whole = pinocchio_model(model.urdf)
        shapes = _shapes(whole, model.urdf)
        self.kinematics: Any
        self.kinematics, self.geometry = pin.buildReducedModel(
            whole, shapes, *locked_joints(whole, model.config.locked)
        )
        own = self.geometry.ngeoms
        for name in model.config.obstacles:
            _add_obstacle(self.geometry, model.path.parent / name)
        self._obstacles = range(own, self.geometry.ngeoms)
        if self.floor is not None:
            plane = coal.Halfspace(np.array([0.0, 0.0, 1.0]), self.floor)
            self.geometry.addGeometryObject(pin.GeometryObject(_FLOOR, 0, 0, pin.SE3.Identity(), plane))
        self._data = self.kinematics.createData()
        pairs = self._comparable()
        overlap = self._always_touching(pairs, [0.0] * len(pairs))
        self.permanent = tuple(self._names(pair) for pair in overlap)
        self._check_obstacles(overlap)
        pairs = [pair for pair in pairs if pair not in overlap]
        near = self._always_touching(pairs, [margin] * len(pairs))
        self._checked = self._set_pairs(pairs, [0.0 if pair in near else margin for pair in pairs])

    def __getstate__(self) -> dict[str, Any]:
        """All but what Pinocchio computes in; another process needs none of the files."""
        left_out = {"_data": None, "_checked": [float(margin) for margin in self.margins]}
        return {**vars(self), **left_out}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """State of an equal checker, with memory of its own to compute in."""
        vars(self).update(state)
        self._data = self.kinematics.createData()
        pairs = [(pair.first, pair.second) for pair in self.geometry.collisionPairs]
        self._checked = self._set_pairs(pairs, state["_checked"])

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """All shapes but the floor, including those of base and obstacles."""
        place = {self.kinematics.getJointId(name): i for i, name in enumerate(self.model.joint_names)} | {
            0: -1
        }
        return tuple(
            Shape(
                o.name,
                o.geometry,
                place[o.parentJoint],
                np.array(o.placement.rotation),
                np.array(o.placement.translation),
            )
            for o in self.geometry.geometryObjects
            if o.name != _FLOOR
        )

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Names of the compared shapes."""
        return tuple(self._names((p.first, p.second)) for p in self.geometry.collisionPairs)

    @property
    def margins(self) -> np.ndarray:
        """Distance (pairs,), m, below which each pair counts as touching."""
        return np.array([request.security_margin for request in self._checked.collisionRequests])

    def collides(self, q: np.ndarray) -> np.ndarray:
        """Mask (samples,) of colliding configurations `q` (samples, n)."""
        import pinocchio as pin

        q = joint_batch(self.model, q)
        if not len(self.geometry.collisionPairs):
            return np.zeros(len(q), dtype=bool)
        return np.array(
            [
                pin.computeCollisions(self.kinematics, self._data, self.geometry, self._checked, values, True)
                for values in self.configurations(q)
            ],
            dtype=bool,
        )

    def colliding(self, q: np.ndarray) -> tuple[tuple[str, str], ...]:
        """Names of colliding shapes at one configuration `q` (n,)."""
        touching = self._touching(self.configurations(joint_batch(self.model, q))[0])
        return tuple(names for names, touches in zip(self.pairs, touching, strict=True) if touches)

    def _comparable(self) -> list[tuple[int, int]]:
        objects, parents = self.geometry.geometryObjects, self.kinematics.parents
        result = []
        for i, one in enumerate(objects):
            for j in range(i + 1, len(objects)):
                first, second = sorted((one.parentJoint, objects[j].parentJoint))
                neighbours = first == second or parents[second] == first
                if not neighbours or (j in self._obstacles and first != second):
                    result.append((i, j))
        return result

    def _check_obstacles(self, overlap: list[tuple[int, int]]) -> None:
        for first, second in overlap:
            if second in self._obstacles:
                link, obstacle = self._names((first, second))
                raise InputError(
                    "E-DESIGN-035",
                    f"the obstacle {obstacle} touches {link} of {self.model.name} in every configuration; correct "
                    "its position in its URDF, which is in the robot's base frame, or remove it from `obstacles:`.",
                )

    def _set_pairs(self, pairs: list[tuple[int, int]], margins: list[float]) -> Any:
        import pinocchio as pin

        self.geometry.removeAllCollisionPairs()
        for first, second in pairs:
            self.geometry.addCollisionPair(pin.CollisionPair(first, second))
        checked = self.geometry.createData()
        for request, margin in zip(checked.collisionRequests, margins, strict=True):
            request.security_margin = margin
        return checked

    def _always_touching(self, pairs: list[tuple[int, int]], margins: list[float]) -> list[tuple[int, int]]:
        self._checked = self._set_pairs(pairs, margins)
        always = np.ones(len(pairs), dtype=bool)
        for values in self.configurations(low_discrepancy_configurations(self.model, _SAMPLES)):
            if not always.any():
                break
            always &= self._touching(values)
        return [pair for pair, touches in zip(pairs, always, strict=True) if touches]

    def _touching(self, values: np.ndarray) -> np.ndarray:
        import pinocchio as pin

        pin.computeCollisions(self.kinematics, self._data, self.geometry, self._checked, values, False)
        return np.array([result.isCollision() for result in self._checked.collisionResults], dtype=bool)

    def _names(self, pair: tuple[int, int]) -> tuple[str, str]:
        objects = self.geometry.geometryObjects
        return objects[pair[0]].name, objects[pair[1]].name

    def configurations(self, q: np.ndarray) -> np.ndarray:
        """Pinocchio's configurations (samples, nq), in which an unbounded joint is a cosine and a sine."""
        q = joint_positions(self.model, q)
        result = np.empty((len(q), self.kinematics.nq))
        for i, name in enumerate(self.model.joint_names):
            joint = self.kinematics.joints[self.kinematics.getJointId(name)]
            if joint.nq == 1:
                result[:, joint.idx_q] = q[:, i]
            else:
                result[:, joint.idx_q], result[:, joint.idx_q + 1] = np.cos(q[:, i]), np.sin(q[:, i])
        return result


def is_hanging(model: RobotModel, floor: float = 0.0) -> bool:
    """Whether the first target is above the height `floor`, m, in hardly any configuration, as of a robot below a ceiling."""
    if not model.points:
        return False
    q = low_discrepancy_configurations(model, _SAMPLES)
    height = point_kinematics(model, q, jacobians=False).position[:, 2]
    return bool(np.mean(height > floor) < _STANDING)


def _shapes(pin_model: Any, urdf: Path) -> Any:
    import coal
    import pinocchio as pin

    try:
        geometry = pinocchio_shapes(pin_model, urdf, pin.GeometryType.COLLISION)
    except (ValueError, RuntimeError) as problem:
        reason = str(problem).strip().splitlines()[0]
        raise InputError(
            "E-DESIGN-036",
            f"{urdf}: its collision shapes cannot be read ({reason}); put the meshes beside it, or the package into a folder "
            "above it, or use primitives.",
        ) from problem
    for item in geometry.geometryObjects:
        if isinstance(item.geometry, coal.BVHModelBase):
            item.geometry.buildConvexRepresentation(False)
            item.geometry = item.geometry.convex
    return geometry


def _add_obstacle(geometry: Any, path: Path) -> None:
    import pinocchio as pin

    if not path.is_file():
        raise InputError(
            "E-DESIGN-037", f"{path}: there is no such obstacle; correct `obstacles:` in robot.yaml."
        )
    try:
        model = pinocchio_model_of(read_elements(path).text())
    except (ValueError, RuntimeError) as problem:
        raise InputError(
            "E-DESIGN-038", f"{path}: not a valid URDF; correct it or remove it from `obstacles:`."
        ) from problem
    if model.njoints > 1:
        raise InputError(
            "E-DESIGN-039", f"{path}: an obstacle must not move, but this one has joints; make them fixed."
        )
    for item in _shapes(model, path).geometryObjects:
        name = f"{path.stem}.{item.name}"
        placed = pin.GeometryObject(name, 0, 0, item.placement, item.geometry)
        placed.meshPath = item.meshPath
        geometry.addGeometryObject(placed)
