"""Static equilibrium of an elastic arm whose joints follow others: gravity's load is carried over to what moves them."""

from __future__ import annotations

import numpy as np

from flexcal.model.kinematics import JointMotion, joint_motion
from flexcal.model.robot import ORIGIN, RobotModel

_ITERATIONS = 30
_TOLERANCE = 1e-13
_DIFFERENCE = 1e-4
"""Step, rad, of the central differences for how a loop's ratios change as it moves."""


def related_equilibrium(
    model: RobotModel,
    axes: list[tuple[int, int]],
    stiffness: np.ndarray,
    q: np.ndarray,
    slack: np.ndarray,
    payload: np.ndarray,
    *,
    sensitivities: bool,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Deflection (samples, N, 3), compliance (samples, d, d), regressor (samples, d, 4 N), coupling (samples, d, G), last step (rad).

    At the minimum of V(θ(x)) + ½ xᵀ K x over the elastic coordinates x, the joints' deviations from motor or relation beyond `slack`
    (samples, N): the load is Bᵀ (-∂V/∂θ) and the stiffness Bᵀ ∂²V/∂θ² B + K + Σ ∂V/∂θᵢ ∂²θᵢ/∂x² with B = ∂θ/∂x. Raises `ValueError` where
    the springs cannot carry the arm.
    """
    arm = _Arm(model, axes, q, payload)
    own = np.zeros((len(q), len(model.joints), 3))
    own[:, :, 2] = slack
    x = np.zeros((len(q), len(axes)))
    largest = 0.0
    springs = np.diag(stiffness)
    loops = bool(model.relations and model.relations.loops)
    for _ in range(_ITERATIONS):
        motion = arm.motion(own, x)
        b = arm.by_coordinate(motion)
        load, gravity, _, _ = arm.loads(motion)
        force = np.matmul(load[:, None, :], b)[:, 0] - x * stiffness
        whole = np.swapaxes(b, 1, 2) @ gravity @ b + springs
        step = _solved(whole, force)
        x = x + step
        largest = float(np.nanmax(np.abs(step), initial=0.0))
        if largest < _TOLERANCE:
            break
    deflection = np.zeros_like(own)
    deflection[:, arm.joints, arm.components] = x
    if not sensitivities:
        empty = np.zeros((0, 0, 0))
        return deflection, empty, empty, empty, largest
    motion = arm.motion(own, x)
    b = arm.by_coordinate(motion)
    load, gravity, regressor, coupling = arm.loads(motion)
    down = np.swapaxes(b, 1, 2)
    whole = down @ gravity @ b + springs
    joints = len(model.joints)
    by_errors = down @ (gravity[:, :, 2::3] @ motion.by_geometry)
    by_errors[:, :, : 6 * joints] += down @ coupling
    for joint in model.branching:
        first = model.geometry_columns.get(f"{model.joints[joint].name}.{ORIGIN[0]}")
        parent = model.joints[joint].parent
        if first is not None and parent >= 0:
            moments = down @ regressor[:, :, 4 * parent + 1 : 4 * parent + 4]
            by_errors[:, :, first : first + 3] += arm.weight_beyond(joint)[:, None, None] * moments
    if loops:
        bend, twist = arm.curvature(own, x, -load[:, 2::3])
        whole += bend
        by_errors += twist
    compliance = np.linalg.inv(_finite(whole))
    return deflection, compliance, down @ regressor, by_errors, largest


def _finite(stiffness: np.ndarray) -> np.ndarray:
    """Stiffness matrices (samples, d, d), unit ones in place of those that are not finite."""
    good = np.asarray(np.isfinite(stiffness).all(axis=(1, 2)))
    return np.where(good[:, None, None], stiffness, np.eye(stiffness.shape[1]))


def _solved(stiffness: np.ndarray, force: np.ndarray) -> np.ndarray:
    whole = _finite(stiffness)
    if len(whole) and whole.shape[1] and not np.linalg.eigvalsh(whole)[:, 0].min() > 0:
        raise ValueError("the springs cannot carry the arm: the equilibrium is not stable")
    return np.linalg.solve(whole, force[:, :, None])[:, :, 0]


class _Arm:
    """Motions and loads at motor positions `q` (samples, n) carrying `payload` (samples,) kg, for coordinates `axes`."""

    def __init__(
        self, model: RobotModel, axes: list[tuple[int, int]], q: np.ndarray, payload: np.ndarray
    ) -> None:
        self.model, self.q, self.payload = model, q, payload
        self.joints = [joint for joint, _ in axes]
        self.components = [component for _, component in axes]
        self.columns = [3 * joint + component for joint, component in axes]
        order = (1, 0, 2) if model.bearings == "before" else (2, 1, 0)
        self.every = [(joint, component) for joint in range(len(model.joints)) for component in order]
        self.places = np.argsort([3 * joint + component for joint, component in self.every])

    def motion(self, own: np.ndarray, x: np.ndarray) -> JointMotion:
        """Motion of all joints deviating by `own` (samples, N, 3) and the coordinates `x` (samples, d)."""
        moved = own.copy()
        moved[:, self.joints, self.components] += x
        return joint_motion(self.model, self.q, moved, derivatives=True)

    def by_coordinate(self, motion: JointMotion) -> np.ndarray:
        """∂θ/∂x (samples, 3 N, d): tilts and positions of all joints by the coordinates."""
        size = 3 * len(self.model.joints)
        b = np.tile(np.eye(size)[:, self.columns], (len(self.q), 1, 1))
        b[:, 2::3] += motion.by_motion[:, :, self.columns]
        return b

    def loads(self, motion: JointMotion) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """-∂V/∂θ (samples, 3 N), ∂²V/∂θ² (samples, 3 N, 3 N), and ∂(∂V/∂θ) by mass and moments (…, 4 N) and errors of joints (…, 6 N)."""
        model, declared = self.model, self.model.payload
        load, stiffness, regressor, coupling = model.tree.gravity_loads(
            self.every,
            np.ascontiguousarray(model.geometry.errors),
            np.ascontiguousarray(model.links.mass),
            np.ascontiguousarray(model.links.mass[:, None] * model.links.com),
            self.payload,
            declared.joint if declared else -1,
            np.ascontiguousarray(declared.com_in_link if declared else np.zeros(3)),
            model.gravity,
            np.ascontiguousarray(motion.q),
            np.ascontiguousarray(motion.deflection),
        )
        at = self.places
        return load[:, at], stiffness[:, at][:, :, at], regressor[:, at], coupling[:, at]

    def weight_beyond(self, joint: int) -> np.ndarray:
        """Mass (samples,), kg, of what a joint carries."""
        model, declared = self.model, self.model.payload
        beyond = [i for i in range(len(model.joints)) if joint in model.path_to(i)]
        held = self.payload if declared is not None and declared.joint in beyond else np.zeros(len(self.q))
        return model.links.mass[beyond].sum() + held

    def curvature(self, own: np.ndarray, x: np.ndarray, pull: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Σ ∂V/∂θᵢ ∂²θᵢ/∂x² (samples, d, d) and Σ ∂V/∂θᵢ ∂²θᵢ/∂x∂g (samples, d, G) for `pull` ∂V/∂θ (samples, N), by differences."""
        size = len(self.q), x.shape[1]
        bend = np.zeros((*size, x.shape[1]))
        twist = np.zeros((*size, len(self.model.geometry_columns)))
        relations = self.model.relations
        assert relations is not None
        for k in np.flatnonzero(np.isin(self.joints, relations.closing)):
            shift = _DIFFERENCE * np.eye(x.shape[1])[k]
            ahead, behind = (self.motion(own, x + sign * shift) for sign in (1, -1))
            by_motion = (ahead.by_motion - behind.by_motion)[:, :, self.columns] / (2 * _DIFFERENCE)
            by_geometry = (ahead.by_geometry - behind.by_geometry) / (2 * _DIFFERENCE)
            bend[:, k] = np.matmul(pull[:, None, :], by_motion)[:, 0]
            twist[:, k] = np.matmul(pull[:, None, :], by_geometry)[:, 0]
        return bend, twist
