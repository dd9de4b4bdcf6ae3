"""An identified payload, and the content of its results.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from flexcal.dynamics.payload import PayloadFit
from flexcal.estimation import Estimate
from flexcal.files.formats import Block
from flexcal.jobs.pages import TorqueIdentification, estimate_row
from flexcal.jobs.payload.remarks import declared_payload, other_payloads, payload_remarks
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord, header, quantities
from flexcal.model.robot import RobotModel, torque_units
from flexcal.report.checks import Trust, payload_checks
from flexcal.units import MILLIMETRE


@dataclass(frozen=True, eq=False, repr=False)
class PayloadIdentification(TorqueIdentification):
    """Result of `identify_payload`: mass, centre of mass and inertia of the payload.

    Attributes
    ----------
    model : RobotModel
        The robot with this payload.
    estimate : Estimate
        `payload.mass` (kg), `payload.com_x` … (m) and `payload.Ixx` … (kg m², about the centre of mass), in `frame`.
    predictions : tuple of TorquePrediction
        Measured and predicted torques of every log, first those with the payload.
    declared : RobotModel
        The robot as robot.yaml and URDF declare it, to compare with.
    frame : str
        URDF frame of the payload.
    fit : PayloadFit
        Errors of the torques, and the distance to the nearest physically consistent payload.
    loaded, free : tuple of Path
        Logs with and without the payload.
    signals : mapping
        Filters and decimation, as results.json has them.
    weight_faults : tuple of str
        Torques unlike the links' weight that were accepted.
    blocks : mapping of Estimate
        The other estimates of the robot, by block, where they are known.
    estimates : Path, optional
        The file that the estimate was stored in.
    record : RunRecord
        What the result comes from, where it was made from files.
    """

    block: ClassVar[Block] = "payload"
    declared: RobotModel
    frame: str
    fit: PayloadFit
    loaded: tuple[Path, ...]
    free: tuple[Path, ...]
    signals: Mapping[str, Any]
    weight_faults: tuple[str, ...]
    blocks: Mapping[Block, Estimate] = field(default_factory=dict)
    estimates: Path | None = None
    record: RunRecord = NOT_RECORDED

    @property
    def headline(self) -> str:
        """Mass, centre of mass and relative error of the torques."""
        values, std = self.estimate.values, self.estimate.std("payload.mass")
        com = ", ".join(f"{values[f'payload.com_{axis}'] / MILLIMETRE:.4g}" for axis in "xyz")
        mass = f"{values['payload.mass']:.4g} kg" + ("" if std is None else f" ± {std:.2g} kg")
        return f"{mass} at ({com}) mm in {self.frame}, relative torque error {100 * self.fit.error:.2f} %"

    def summary(self) -> str:
        """Mass, centre of mass and inertia with their standard deviations, remarks, verdict, and the line of robot.yaml."""
        rows = [estimate_row(self.estimate, item.name) for item in self.estimate.parameters]
        return "\n".join(
            [self.headline, *rows, *self._numbers["remarks"], self.trust.sentence, self.declaration]
        )

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(payload_checks(self._numbers))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {**header("payload"), **self._numbers, "verdict": self.trust.document()}

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        """Document without the verdict; `declaration` is the corresponding line of robot.yaml."""
        fit, payload = self.fit, self.declared.payload
        joints = self.declared.joint_names
        return {
            "robot": self.declared.name,
            "frame": self.frame,
            "recordings": {"loaded": list(self.loaded), "free": list(self.free)},
            "parameters": quantities(self.estimate),
            "declared": None if payload is None else declared_payload(payload),
            "declaration": self.declaration,
            "error_percent": {
                "train": 100 * fit.error,
                "best": 100 * fit.own_error,
                "per_joint": dict(zip(joints, 100 * fit.joint_errors, strict=True)),
            },
            "torque_units": torque_units(self.declared),
            "robot_mass_kg": float(self.declared.links.mass.sum()),
            "body_rise": fit.rise,
            "other_payloads": other_payloads(self.estimate, self.blocks),
            "signals": dict(self.signals),
            "weight_faults": list(self.weight_faults),
            "remarks": list(payload_remarks(fit, self.declared, self.blocks)),
            "estimates": self.estimates,
            "provenance": dict(self.estimate.provenance),
            "command": self.record.command,
        }

    @property
    def declaration(self) -> str:
        """Line `payload:` of robot.yaml with the identified values."""
        estimate, values = self.estimate, self.estimate.values
        com = ", ".join(f"{values[f'payload.com_{key}']:.5g}" for key in "xyz")
        text = f"frame: {self.frame}, mass: {values['payload.mass']:.5g}, com: [{com}], mass_std: {estimate.std('payload.mass'):.2g}"
        if estimate.identifiable[estimate.parameters.index("payload.Ixx")]:
            payload = self.model.payload
            assert payload is not None
            rows = ", ".join(f"[{', '.join(f'{entry:.4g}' for entry in row)}]" for row in payload.inertia)
            text += f", inertia: [{rows}]"
        return f"payload: {{{text}}}"
