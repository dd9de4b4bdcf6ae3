"""Drive torques in a frequency experiment, and the resulting change of stiffness by gaps and hardening."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.data.plans import MultisinePlan
from flexcal.elasticity.time_periodic.reference_motion import ReferenceMotion
from flexcal.model.robot import RobotModel
from flexcal.model.statics import REFERENCE_TWIST, tangent_ratio, twist_by_hardening, twist_from_torque
from flexcal.model.vibration import ElasticArm, linearise, strain_power

PHASES = 64
"""Number of instants of the reference motion at which the torque is evaluated."""


@dataclass(frozen=True, eq=False)
class HardenedStiffness:
    """Stiffness along the reference motion relative to that at no load, `ratio` (phases, E), and its derivatives by the hardening and by
    the logarithm of the stiffness.
    """

    ratio: np.ndarray
    by_hardening: np.ndarray
    by_stiffness: np.ndarray


@dataclass(frozen=True, eq=False)
class DriveTorque:
    """Torque of the E elastic drives: `slow` (phases, E) N m of gravity and reference motion, and that of the multisine on top of it,
    close to Gaussian, whose lines have the amplitudes `lines` (L, E); `stiffness` (E,) N m/rad of their springs at no load."""

    slow: np.ndarray
    lines: np.ndarray
    stiffness: np.ndarray

    @property
    def size(self) -> np.ndarray:
        """Standard deviation (E,) N m of the multisine's torque."""
        return np.sqrt(0.5 * np.sum(self.lines**2, axis=0))

    @classmethod
    def of(
        cls,
        robot: RobotModel,
        q: np.ndarray,
        payload: float | None,
        plan: MultisinePlan,
        *,
        held: bool = False,
    ) -> DriveTorque:
        """Torque at the mean motor position `q` (n,) rad and `payload` in kg; with `held`, of the held drives too."""
        import pinocchio as pin

        arm = ElasticArm(robot, payload)
        drives = robot.elastic if held else robot.driven
        axes = arm.joint_velocity[[joint.index for joint in drives]]
        motion = ReferenceMotion.of(plan)
        states = motion.states(robot, arm, q, PHASES)
        slow = np.array(
            [pin.rnea(arm.model, arm.data, s.configuration, s.velocity, s.acceleration)[axes] for s in states]
        )
        system = linearise(robot, q, payload)
        power = strain_power(robot, system, plan.frequencies_hz, motion.kp, motion.kd, held=held)
        lines = np.sqrt(2 * np.einsum("Lij,jL->Li", power, motion.excitation**2))
        return cls(slow, lines, np.array([joint.stiffness[2] for joint in drives]))

    def backlash_compliance(self) -> np.ndarray:
        """Added compliance of each drive due to a gap along the reference motion, relative, per rad of half gap, (phases, E).

        A gap ± b twists by b sgn(torque), whose equivalent gain for a Gaussian torque is 2 b times the density of the torque at zero
        (Bussgang 1952), in series with the spring's 1/k.
        """
        density = np.exp(-0.5 * (self.slow / self.size) ** 2) / (np.sqrt(2 * np.pi) * self.size)
        return 2 * self.stiffness * density

    def hardened(self, stiffness: np.ndarray, hardening: np.ndarray) -> HardenedStiffness:
        """Stiffness of drives of `stiffness` (E,) N m/rad at no load and `hardening` (E,) along the reference motion.

        The torque k θ (1 + h (θ/θ₁)²) of a twist with the mean θ̄ and Gaussian about it, 1σ s, has the equivalent stiffness
        k (1 + 3 h (θ̄² + s²)/θ₁²) (Bussgang 1952); θ̄ is the twist under the slow torque.
        """
        twist, size = twist_from_torque(self.slow, stiffness, hardening), self.size / stiffness
        square = 3 * (twist**2 + size**2) / REFERENCE_TWIST**2
        falls = 6 * twist * twist_by_hardening(twist, hardening) / REFERENCE_TWIST**2
        linear = self.slow / stiffness / tangent_ratio(twist, hardening)  # -∂θ̄/∂log k
        return HardenedStiffness(
            1 + hardening * square,
            square + hardening * falls,
            -6 * hardening * (twist * linear + size**2) / REFERENCE_TWIST**2,
        )
