"""Identified actuators of a robot, and the content of their results.json."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from flexcal.actuators import ActuatorFit, Servo
from flexcal.export import Actuators, actuator_name
from flexcal.files.formats import Block
from flexcal.jobs.pages import Identification, estimate_row
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header
from flexcal.report.checks import Trust, actuator_checks


@dataclass(frozen=True, eq=False, repr=False)
class ActuatorIdentification(Identification):
    """Result of `identify_actuators`: gains, delay, friction and armature of every joint, for simulators.

    Attributes
    ----------
    model : RobotModel
        The robot that the links are of; the actuators are no part of it.
    estimate : Estimate
        Parameters `<joint>.actuator.<stiffness|damping|viscous|coulomb|armature|delay>`.
    fit : ActuatorFit
        Actuators, and errors of simulated positions.
    servo : Servo
        What was known of the controllers.
    logs : tuple of str
        Names of the logs.
    seconds : float
        Their duration.
    estimates : Path, optional
        The file that the estimate was stored in.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    block: ClassVar[Block] = "actuators"
    fit: ActuatorFit
    servo: Servo
    logs: tuple[str, ...]
    seconds: float
    estimates: Path | None = None
    record: RunRecord = NOT_RECORDED

    @property
    def actuators(self) -> Actuators:
        """The actuators, as exports take them; what is not identifiable has the value of the fit."""
        return self.fit.actuators

    @property
    def headline(self) -> str:
        """Number of parameters that the logs tell, and the error of simulated positions beside that of the commands."""
        told = sum(self.estimate.identifiable)
        return f"{told} of {len(self.estimate.parameters)} parameters determined; {self._worst}"

    def summary(self) -> str:
        """Every parameter with its standard deviation, remarks, and the verdict."""
        rows = [estimate_row(self.estimate, item.name) for item in self.estimate.parameters]
        return "\n".join([self.headline, *rows, *self.remarks, self.trust.sentence])

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(actuator_checks(self._numbers))

    @property
    def remarks(self) -> tuple[str, ...]:
        """Joints of which the torques are open, and what the numbers mean."""
        return (*self._open_scales, *self._meaning)

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {**header("actuators"), **self._numbers, "verdict": self.trust.document()}

    def write_arrays(self, folder: Path) -> None:
        """Write no arrays: the page shows the results alone."""

    @property
    def _worst(self) -> str:
        share = self.fit.unseen.share
        joint = int(share.argmax())
        return (
            f"in windows outside the fit the simulation misses {100 * share[joint]:.2g} % of the tracking error at "
            f"{self.model.joint_names[joint]}, where it misses most"
        )

    @property
    def _open_scales(self) -> tuple[str, ...]:
        if self.servo.known:
            return ()
        named = [
            joint
            for joint in self.model.joint_names
            if not self.estimate.identifiable[
                self.estimate.parameters.index(actuator_name(joint, "stiffness"))
            ]
        ]
        if not named:
            return ()
        return (
            f"Stiffness, damping, friction and armature of {', '.join(named)} are known up to a common factor only: positions do not tell "
            "torques where neither gravity nor a change of inertia acts. Declare the rotor inertia under `drives:`, or the gains under "
            "`controller:` and give --known-gains; the simulated motion is right in any case.",
        )

    @property
    def _meaning(self) -> tuple[str, ...]:
        said = []
        if "viscous" not in self.servo.keys:
            said.append(
                "The damping is that of controller and viscous friction together: they have one effect."
            )
        if self.servo.compensates_gravity:
            said.append(
                "The controller compensates gravity: without that the simulation is worse. The links' inertias alone tell torques then."
            )
        if self.model.payload is not None and self.model.payload.mass > 0:
            said.append(f"The payload of {self.model.payload.mass:.3g} kg is taken as held in all logs.")
        said.append(
            "All torques are relative to masses and inertias of the links"
            + (", and to the given gains." if self.servo.known else ".")
        )
        return tuple(said)

    @property
    def _numbers(self) -> dict[str, Any]:
        fit, names = self.fit, self.model.joint_names
        errors = {
            joint: {
                "noise": float(fit.noise[i]),
                "fitted": {
                    "simulated": float(fit.fitted.simulated[i]),
                    "commanded": float(fit.fitted.commanded[i]),
                },
                "held_out": {
                    "simulated": float(fit.unseen.simulated[i]),
                    "commanded": float(fit.unseen.commanded[i]),
                },
            }
            for i, joint in enumerate(names)
        }
        parameters = {
            item.name: {**self.estimate.quantity(item.name), "unit": item.unit}
            for item in self.estimate.parameters
        }
        return {
            "robot": self.model.name,
            "damping": "error" if self.servo.follows_velocity else "velocity",
            "gravity": "compensated" if self.servo.compensates_gravity else "felt",
            "known_gains": self.servo.known,
            "parameters": parameters,
            "fit": {
                "status": self.estimate.status,
                "message": self.estimate.message,
                "iterations": self.estimate.iterations,
            },
            "errors": errors,
            "windows": {"fitted": fit.windows[0], "held_out": fit.windows[1], "settling_s": fit.settling},
            "logs": list(self.logs),
            "seconds": self.seconds,
            "remarks": list(self.remarks),
            "estimates": self.estimates,
            **self.record.document(),
        }
