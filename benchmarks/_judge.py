"""One evaluator for all trajectories: how well they are conditioned, what they tell, which limits they break."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from flexcal.design.scene import CollisionChecker
from flexcal.dynamics.inverse_model import CLASSIC, BaseParameters, Observation
from flexcal.dynamics.signals import Motion
from flexcal.model.robot import RobotModel
from flexcal.model.torques import inertial_parameters, torque_regressor


@dataclass(frozen=True, eq=False)
class Judge:
    """The base observation matrix W of a rigid robot: links' inertials, rotor inertia, viscous and Coulomb friction, torque offset.

    One row a sample and joint, all weighing the same; motions are q, q̇, q̈ (3, N, n).
    """

    model: RobotModel

    @cached_property
    def observation(self) -> Observation:
        """All columns."""
        return Observation(self.model, CLASSIC)

    @cached_property
    def base(self) -> BaseParameters:
        """Which of them are kept."""
        return BaseParameters.of(self.observation)

    @cached_property
    def itself(self) -> CollisionChecker:
        """Bodies nearer than 10 mm to each other touch."""
        return CollisionChecker(self.model, floor=None)

    @cached_property
    def on_floor(self) -> CollisionChecker:
        """Or to the floor."""
        return CollisionChecker(self.model)

    def matrix(self, motion: np.ndarray) -> np.ndarray:
        """W (n N, r)."""
        q, dq, ddq = motion
        samples = len(q)
        columns = self.observation.columns(Motion(np.arange(samples), q, dq, ddq, np.zeros_like(q)))
        found = np.zeros((self.model.n * samples, len(self.observation.names)))
        for joint, (block, members) in enumerate(zip(columns, self.observation.column_indices, strict=True)):
            found[joint * samples : (joint + 1) * samples, members] = block.T
        return found[:, list(self.base.identifiability.kept)]

    def merits(self, motion: np.ndarray) -> tuple[float, float]:
        """cond(W) with columns of unit norm, and log det(WᵀW / N) with columns in SI units, whose scale adds the same to all trajectories.

        inf and -inf where a column is silent.
        """
        triangle = np.linalg.qr(self.matrix(motion), mode="r")
        norms = np.linalg.norm(triangle, axis=0)
        if not norms.all():
            return np.inf, -np.inf
        values = np.linalg.svd(triangle / norms, compute_uv=False)
        information = (
            2 * np.log(norms).sum() + 2 * np.log(values).sum() - len(norms) * np.log(motion.shape[1])
        )
        return float(values[0] / values[-1]), float(information)

    def violations(self, motion: np.ndarray) -> dict[str, float]:
        """What is broken at any sample: the largest use of a limit (1 is all of it), or the share of samples that touch."""
        q, dq, ddq = motion
        joints = self.model.joints
        lower, upper, velocity, effort = np.array(
            [(j.lower, j.upper, j.velocity, j.effort) for j in joints]
        ).T
        rotor, viscous, coulomb = np.nan_to_num(
            [self.model.drives.rotor_inertia, self.model.drives.viscous, self.model.drives.coulomb]
        )
        torque = torque_regressor(self.model, q, dq, ddq) @ inertial_parameters(self.model)
        torque += rotor * ddq + viscous * dq + coulomb * np.sign(dq)
        used = {
            "position": np.abs(2 * q - upper - lower).max(axis=0) / (upper - lower),
            "velocity": np.abs(dq).max(axis=0) / velocity,
            "torque": np.abs(torque).max(axis=0) / effort,
        }
        broken = {name: float(np.max(share)) for name, share in used.items() if np.max(share) > 1 + 1e-9}
        touches = self.itself.collides(q)
        shares = {"itself": touches.mean(), "floor": (self.on_floor.collides(q) & ~touches).mean()}
        return {**broken, **{name: float(share) for name, share in shares.items() if share}}
