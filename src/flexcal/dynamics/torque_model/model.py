"""Inverse dynamics of a robot with friction: torques of its motors for a motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.dynamics.inverse_model import motor_shares
from flexcal.dynamics.torque_model.velocities import VELOCITY_TERMS, stored_velocities
from flexcal.estimation import Estimate
from flexcal.files.formats import Block
from flexcal.model.parts import LINK_PARAMETERS, parallel_axis
from flexcal.model.robot import FRICTION_PARAMETERS, RobotModel
from flexcal.model.statics import carried_mass, twist_from_torque
from flexcal.model.torques import inertial_parameters, torque_regressor

_PASSES = 6
"""Each brings the load of twisted drives nearer by their stiffness over that of gravity, a hundred or more."""


@dataclass(frozen=True, eq=False)
class TorqueModel:
    """Torques of the motors for a motion: links, payload, rotors, friction, couplings, springs and cables (Eq. 2.20).

    The robot is warm, and rigid unless asked for: friction that fades as it warms up is left out, and friction that builds up over a
    presliding travel is at its full value. At rest Coulomb friction is zero. Torques are the true ones: a log or a controller whose
    torque constants are off has them divided by `<joint>.drive_gain`, where that was estimated.

    Attributes
    ----------
    model : RobotModel
        The robot with its estimates.
    velocities : mapping of ndarray
        Velocities (n,), rad/s or m/s, of Stribeck friction, and of that which grows with the load.
    identified : bool
        Whether dynamics were identified; else the links are those of the URDF, and friction is what robot.yaml says.

    Examples
    --------
    >>> from flexcal import RobotModel, TorqueModel
    >>> model = RobotModel.from_yaml("examples/tx40/robot.yaml", estimates=False)
    >>> TorqueModel.of(model).torque([[0, 0, 0, 0, 0, 0]], [[0] * 6], [[0] * 6]).shape
    (1, 6)
    """

    model: RobotModel
    velocities: Mapping[str, np.ndarray]
    identified: bool

    @classmethod
    def of(cls, model: RobotModel, provenance: Mapping[str, str] | None = None) -> TorqueModel:
        """Torque model of a robot.

        Parameters
        ----------
        model : RobotModel
            The robot with its estimates.
        provenance : mapping of str, optional
            Provenance of the estimate of its dynamics, which has the velocities of Stribeck terms; none where they are not identified.

        Returns
        -------
        TorqueModel
            Its torques.

        Raises
        ------
        FlexcalError
            For a robot whose joints follow others, and Stribeck terms without velocities.
        """
        model.require_motors("torques of dynamics")
        velocities = {
            term: stored_velocities(model, term, _friction(model, term), provenance or {})
            for term in VELOCITY_TERMS
        }
        return cls(model, velocities, provenance is not None)

    @classmethod
    def of_blocks(cls, model: RobotModel, blocks: Mapping[Block, Estimate]) -> TorqueModel:
        """Torque model of a robot with the estimates of `blocks`.

        Parameters
        ----------
        model : RobotModel
            The robot with these estimates.
        blocks : mapping of Estimate
            Estimates by block.

        Returns
        -------
        TorqueModel
            Its torques.

        Raises
        ------
        FlexcalError
            As `of` does.
        """
        return cls.of(model, blocks["dynamics"].provenance if "dynamics" in blocks else None)

    def torque(
        self,
        q: np.ndarray,
        dq: np.ndarray,
        ddq: np.ndarray,
        payload: np.ndarray | None = None,
        *,
        elastic: bool = False,
    ) -> np.ndarray:
        """Torques of the motors.

        Parameters
        ----------
        q, dq, ddq : ndarray
            Motion (N, n) of the motors, referred to the joints, rad, m and s.
        payload : ndarray, optional
            Payload (N,), kg; by default as declared.
        elastic : bool
            Whether the links stand where the drive springs let them, twisted by what the motion asks of them; the twist itself does not
            move, so that the motion has to be slow beside the drives' resonances. Bearings are rigid.

        Returns
        -------
        ndarray
            Torques (N, n), N m, or forces, N, of prismatic joints, referred to the joints.

        Raises
        ------
        FlexcalError
            Where the shapes differ, and for a payload without a declaration.
        """
        q, dq, ddq = (np.atleast_2d(np.asarray(values, dtype=float)) for values in (q, dq, ddq))
        load = self._links(q, dq, ddq, payload)
        if elastic and self.model.elastic:
            for _ in range(_PASSES):
                load = self._links(q - self._twist(load), dq, ddq, payload)
        return load + self._drives(q, dq, ddq, np.abs(load))

    def _links(
        self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, payload: np.ndarray | None
    ) -> np.ndarray:
        """Torques (N, n) that move links and payload."""
        regressor = torque_regressor(self.model, q, dq, ddq)
        load = regressor @ inertial_parameters(self.model)
        held = self.model.payload
        if held is not None:
            own = (
                regressor[:, :, len(LINK_PARAMETERS) * held.joint :][:, :, : len(LINK_PARAMETERS)]
                @ self._per_kilogram
            )
            load = load + carried_mass(self.model, payload, len(q))[:, None] * own
        elif payload is not None:
            carried_mass(self.model, payload, len(q))
        return load

    def _twist(self, load: np.ndarray) -> np.ndarray:
        """Twist (N, n), rad, of the drives under a load (N, n), N m, backlash included."""
        springs = self.model.springs
        joints = [joint.index for joint in self.model.elastic]
        twist = np.sign(load) * self.model.drives.backlash
        twist[:, joints] += twist_from_torque(
            load[:, joints], springs.stiffness[joints, 2], springs.hardening[joints]
        )
        return twist

    def _drives(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Torques (N, n) of rotors, friction, couplings, springs and cables under the links' `load` (N, n)."""
        model = self.model
        drives, (stiffness, constant) = model.drives, self._springs
        known = self._classic
        torque = (
            known["rotor_inertia"] * ddq
            + known["viscous"] * dq
            + known["coulomb"] * np.sign(dq)
            + known["torque_offset"]
        )
        torque += stiffness * q + constant
        for entry, values in zip(model.config.drives.coupling, np.nan_to_num(drives.coupling), strict=True):
            motor, joint, ratio = model.joint_index(entry.motor), model.joint_index(entry.joint), entry.ratio
            inertia, viscous, coulomb = values
            sign = np.sign(dq[:, motor] + ratio * dq[:, joint])
            torque[:, motor] += ratio * (inertia * ddq[:, joint] + viscous * dq[:, joint]) + coulomb * sign
            torque[:, joint] += ratio * (inertia * ddq[:, motor] + viscous * dq[:, motor] + coulomb * sign)
        shares = motor_shares(model)
        speed = dq @ shares.T
        sign = np.sign(speed)
        by_key = {key: _friction(model, key) for key in FRICTION_PARAMETERS}
        fading = {term: np.exp(-((speed / velocity) ** 2)) for term, velocity in self.velocities.items()}
        own = by_key["coulomb_asymmetry"] * np.abs(sign)
        own = own + sign * (
            by_key["sublinear_viscous"] * np.sqrt(np.abs(speed))
            + by_key["presliding"]
            + by_key["stribeck"] * fading["stribeck"]
            + load * (by_key["load_coulomb"] + by_key["load_stribeck"] * fading["load_stribeck"])
        )
        return torque + own @ shares

    @property
    def _classic(self) -> dict[str, np.ndarray]:
        """Parameters (n,) of rotors and of the classic friction terms by name, zero where there is none."""
        return {key: np.nan_to_num(getattr(self.model.drives, key)) for key in _CLASSIC}

    @property
    def _per_kilogram(self) -> np.ndarray:
        """The ten parameters of a payload of 1 kg, in its link."""
        held = self.model.payload
        assert held is not None
        one = held.carried(1.0)
        inertia = one.inertia + parallel_axis(one.mass, one.com)
        return np.array([1.0, *one.com, *inertia[np.triu_indices(3)]])

    @property
    def _springs(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness (n,), N m/rad, and constant torque (n,), N m, of springs and cables parallel to the joints."""
        model, config = self.model, self.model.config.dynamics
        stiffness, constant, cable = np.nan_to_num(model.drives.parallel).T.copy()
        constant = constant + cable
        for spring in config.joint_springs:
            joint = model.joint_index(spring.joint)
            if spring.stiffness is not None:
                stiffness[joint] = spring.stiffness
            constant[joint] -= stiffness[joint] * (spring.rest or 0.0)
        for entry in config.cable_torques:
            constant[model.joint_index(entry.joint)] += entry.torque or 0.0
        return stiffness + _friction(model, "cable_stiffness"), constant

    def document(self) -> dict[str, Any]:
        """What the runtime needs, as a JSON document."""
        model, drives = self.model, self.model.drives
        stiffness, constant = self._springs
        columns = {
            **self._classic,
            **{key: _friction(model, key) for key in _KEPT},
            **{f"{term}_velocity": velocity for term, velocity in self.velocities.items()},
            "spring_stiffness": stiffness,
            "spring_torque": constant,
        }
        inertials = inertial_parameters(model).reshape(model.n, -1)
        return {
            "identified": self.identified,
            "joints": [
                {
                    "inertia": inertials[i, 4:].tolist(),
                    **{key: float(values[i]) for key, values in columns.items()},
                }
                for i in range(model.n)
            ],
            "couplings": [
                {
                    "motor": model.joint_index(entry.motor),
                    "joint": model.joint_index(entry.joint),
                    "ratio": entry.ratio,
                    "rotor_inertia": float(inertia),
                    "viscous": float(viscous),
                    "coulomb": float(coulomb),
                }
                for entry, (inertia, viscous, coulomb) in zip(
                    model.config.drives.coupling, np.nan_to_num(drives.coupling), strict=True
                )
            ],
            "payload_inertia": None if model.payload is None else self._per_kilogram[4:].tolist(),
        }


_CLASSIC = ("rotor_inertia", "viscous", "coulomb", "torque_offset")
_KEPT = ("coulomb_asymmetry", "sublinear_viscous", "presliding", "stribeck", "load_coulomb", "load_stribeck")
"""Friction that does not pass as the robot warms up; cables are springs."""


def _friction(model: RobotModel, key: str) -> np.ndarray:
    """Coefficients (n,) of a friction term beyond the classic ones, zero where there is none."""
    return np.nan_to_num(model.drives.friction[:, FRICTION_PARAMETERS.index(key)])
