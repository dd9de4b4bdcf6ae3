"""Identified dynamics of a robot, and the content of their results.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from flexcal.dynamics import residual  # loaded where one was learned
from flexcal.dynamics.diagnostics import EssentialParameters, ExternalShare, GravityRatio
from flexcal.dynamics.estimators import EstimatorName
from flexcal.dynamics.friction import FrictionSelection
from flexcal.dynamics.inverse_model import Observation
from flexcal.dynamics.regression import RegressionData
from flexcal.dynamics.signals import Motion
from flexcal.errors import FlexcalError
from flexcal.files.formats import Block
from flexcal.jobs.dynamics.remarks import (
    dynamics_notes,
    dynamics_remarks,
    selection_remark,
    unlike_log_notes,
)
from flexcal.jobs.logs import Preprocessing
from flexcal.jobs.pages import TorqueIdentification, summary_row
from flexcal.jobs.result_files import (
    ESTIMATES,
    NOT_RECORDED,
    RunRecord,
    dropped_parameters,
    header,
    quantities,
)
from flexcal.model.parts import is_physically_consistent
from flexcal.model.robot import torque_units
from flexcal.model.torques import motion_batch
from flexcal.report.checks import Trust, dynamics_checks

if TYPE_CHECKING:
    from flexcal.jobs.dynamics.encoder_bias import EncoderBias
    from flexcal.jobs.dynamics.learned_residual import LearnedDynamics
    from flexcal.jobs.fleet_prior import PooledUse


@dataclass(frozen=True, eq=False, repr=False)
class DynamicsIdentification(TorqueIdentification):
    """Result of `identify_dynamics`: the estimate, and its torque prediction errors inside and outside the fit.

    Attributes
    ----------
    model : RobotModel
        The robot with the estimate.
    estimate : Estimate
        Base parameters of inertia, and friction, SI units.
    predictions : tuple of TorquePrediction
        Measured and predicted torques of all logs.
    estimator : str
        Name of the estimator.
    structural_rank : int
        Number of parameters that any motion can determine.
    train : RegressionData
        Equations of the fit.
    held_out : RegressionData or None
        Equations kept out of the fit.
    hold_out : float
        Share of the time at the end of every log that was kept out of the fit.
    validated : tuple of Path
        Logs that were kept out of the fit.
    essential : EssentialParameters
        Parameters that the torques need, by their significance.
    friction : FrictionSelection
        Choice of the friction terms.
    motors : tuple of str
        Joints whose motors have equations of their own.
    preprocessing : Preprocessing
        Filters and decimation of the logs.
    signals : mapping
        The same as results.json has it (`preprocessing_document`).
    weight_faults : tuple of str
        Torques unlike the links' weight that were accepted.
    weight_shares : mapping of GravityRatio
        Identified weight of the links over that of the URDF; empty where it was accepted.
    external : ExternalShare or None
        How much of the measured external torques appears in the motors' torques; None without a force sensor.
    encoders : EncoderBias or None
        What rounded positions did to flexible drives; None where they are not rounded, or the drives are rigid.
    learned : LearnedDynamics or None
        Learned residual torques, where they were asked for.
    pooled : PooledUse or None
        What it had from other robots of the model.
    seconds : float
        Duration of the identification.
    estimates : Path or None
        File that the estimate was stored in.
    record : RunRecord
        What the result comes from.
    """

    block: ClassVar[Block] = "dynamics"
    estimator: EstimatorName
    structural_rank: int
    train: RegressionData
    held_out: RegressionData | None
    hold_out: float
    validated: tuple[Path, ...]
    essential: EssentialParameters
    friction: FrictionSelection
    motors: tuple[str, ...]
    preprocessing: Preprocessing
    signals: Mapping[str, Any]
    weight_faults: tuple[str, ...]
    weight_shares: Mapping[str, GravityRatio]
    external: ExternalShare | None
    encoders: EncoderBias | None
    learned: LearnedDynamics | None
    pooled: PooledUse | None
    seconds: float
    estimates: Path | None = None
    record: RunRecord = NOT_RECORDED

    def torque(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        """Torques of a motion by the identified inverse dynamics: inertia, gravity and friction.

        Parameters
        ----------
        q, dq, ddq : ndarray
            Positions, velocities and accelerations (N, n) of the joints, rad or m, and s; successive samples of one motion, where the
            friction depends on what was before.

        Returns
        -------
        ndarray
            Torques (N, n), N m (N at prismatic joints), referred to the joints; a learned residual is not part of them.

        Raises
        ------
        FlexcalError
            Where shapes differ or do not fit the robot, and for a robot that was identified with flexible drives, whose motors have
            equations of their own.
        """
        observation = self.train.observation
        if self.motors:
            raise FlexcalError(
                "E-RUN-098",
                f"{self.model.name} was identified with flexible drives, whose motors move otherwise than the arm; identify it without.",
            )
        assert isinstance(observation, Observation)
        motion = Motion(
            np.arange(len(q), dtype=float), *motion_batch(self.model, q, dq, ddq), np.zeros_like(q)
        )
        parameters = self.estimate.parameters.coordinates()
        columns = zip(observation.columns(motion), observation.column_indices, strict=True)
        return np.stack([parameters[index] @ values for values, index in columns], axis=1)

    def summary(self) -> str:
        """Summary of the fit in text: errors of the torques, base parameters, remarks, verdict."""
        document = self.document()
        rows = [
            summary_row(row["name"], row["estimate"], row["std"], row["unit"])
            for row in document["base_parameters"]
        ]
        return "\n".join(
            [self.headline, *rows, *document["remarks"], *document["notes"], self.trust.sentence]
        )

    @property
    def headline(self) -> str:
        """Rank, estimator and relative errors of the torques."""
        percent = self._numbers["error_percent"]
        unseen = "" if percent["held_out"] is None else f", {percent['held_out']:.2f} % outside it"
        return (
            f"{self.estimate.rank} of {self.train.base.rank} base parameters by {self.estimator}, "
            f"relative torque error {percent['train']:.2f} % in the fit{unseen}"
        )

    def write_arrays(self, folder: Path) -> None:
        """Leave predictions.npz in a folder, and learned_residual.npz if a residual was learned."""
        super().write_arrays(folder)
        if self.learned is not None:
            self.learned.store(folder / ESTIMATES)

    @property
    def bodiless(self) -> tuple[str, ...]:
        """Links whose identified inertials are not physically consistent: valid for torques, not for springs or a URDF."""
        links = (joint.link for joint in self.train.observation.model.joints)
        return tuple(link for link in links if not is_physically_consistent(self.estimate.values, link))

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(dynamics_checks(self._numbers))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        return {**header("dynamics"), **self._numbers, "verdict": self.trust.document()}

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        x = self.estimate.parameters.coordinates()
        error, each = self.train.errors(x)
        joints = self.train.observation.model.joint_names
        percent: dict[str, Any] = {"train": 100 * error, "held_out": None}
        if self.held_out is not None:
            error, each = self.held_out.errors(x)
            percent["held_out"] = 100 * error
        percent["per_joint"] = dict(zip(joints, 100 * each[: len(joints)], strict=True))
        if self.motors:
            others = len(joints) + len(self.motors)
            percent["per_motor"] = dict(zip(self.motors, 100 * each[len(joints) : others], strict=True))
            bearings = self.train.observation.labels[others:]
            if bearings:
                percent["per_bearing"] = dict(zip(bearings, 100 * each[others:], strict=True))
        return {
            "robot": self.train.observation.model.name,
            "structural_rank": self.structural_rank,
            "rank": self.estimate.rank,
            "equations": sum(s.triangle.rows for s in self.train.subsystems),
            "masked_rows": self.train.masked,
            "error_percent": percent,
            "hold_out": {"share": self.hold_out, "logs": [str(log) for log in self.validated]},
            "torque_units": torque_units(self.train.observation.model),
            "bodiless_links": list(self.bodiless),
            "signals": dict(self.signals),
            "friction_terms": list(self.friction.names),
            "friction_shapes": {c.name: c.shape for c in self.friction.chosen if c.shape},
            "friction_tried": [
                {"terms": list(t.terms), "cross_validation_percent": 100 * t.error, "p_value": t.p_value}
                for t in self.friction.trials
            ],
            "weight_faults": list(self.weight_faults),
            "external_share": None if self.external is None else asdict(self.external),
            "selection_remark": selection_remark(self.friction, self.estimate),
            "remarks": list(dynamics_remarks(self.train, self.estimate)),
            "pooled": None if self.pooled is None else self.pooled.document(),
            "notes": [
                *([] if self.pooled is None else self.pooled.remarks),
                *dynamics_notes(self.train, self.estimate, self.estimator, self.encoders),
                *unlike_log_notes(self.predictions),
            ],
            "weight_shares": {
                joint: asdict(share) for joint, share in self.weight_shares.items() if share.unlike
            },
            "weight_compared": len(self.weight_shares),
            "base_parameters": self._base_parameters(),
            "essential_parameters": self._essential_parameters(),
            "parameters": quantities(self.estimate),
            "dropped": dropped_parameters(self.estimate.dropped),
            "learned_residual": None
            if self.learned is None
            else self.learned.document(self.estimates or Path(residual.LEARNED)),
            "seconds": self.seconds,
            "estimates": self.estimates,
            **self.record.document(),
        }

    def _essential_parameters(self) -> dict[str, Any]:
        """Essential base parameters with value and standard deviation, and the torque error with these alone."""
        essential = self.essential
        percent = {"train": 100 * self.train.errors(essential.parameters)[0], "held_out": None}
        if self.held_out is not None:
            percent["held_out"] = 100 * self.held_out.errors(essential.parameters)[0]
        stay = zip(essential.names, essential.values, essential.std, strict=True)
        return {
            "parameters": [{"name": name, "estimate": value, "std": std} for name, value, std in stay],
            "eliminated": list(essential.eliminated),
            "error_percent": percent,
        }

    def _base_parameters(self) -> list[dict[str, Any]]:
        """Value, absolute and relative (%) standard deviation of every base parameter; None for those that the data do not determine.

        `kept` is the parameter that it is counted as; `essential` its value where the others are left out, None where it is left out
        itself.
        """
        essential = dict(zip(self.essential.names, self.essential.values, strict=True))
        base, x = self.train.base, self.estimate.parameters.coordinates()
        hidden = {entry.name for entry in self.estimate.dropped}
        rows = []
        for expression, kept, row in zip(
            base.expressions, base.identifiability.kept, base.identifiability.regrouping, strict=True
        ):
            name, value = base.identifiability.names[kept], float(row @ x)
            std = None if name in hidden else self.estimate.std(name)
            percent = None if std is None or value == 0 else 100 * std / abs(value)
            unit = self.estimate.parameters[name].unit
            rows.append(
                {
                    "name": expression,
                    "kept": name,
                    "unit": unit,
                    "estimate": value,
                    "std": std,
                    "std_percent": percent,
                    "essential": essential.get(name),
                }
            )
        return rows
