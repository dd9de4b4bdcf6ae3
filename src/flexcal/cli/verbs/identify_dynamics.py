"""`flexcal identify dynamics`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    Accept,
    EstimatesFolder,
    Jobs,
    Json,
    MaybePath,
    On,
    Paths,
    Robot,
    file_argument,
    require_robot_and_files,
)
from flexcal.cli.arguments.suggested_commands import after_dynamics, estimates_option
from flexcal.cli.terminal.console import Console
from flexcal.dynamics.estimators import ESTIMATORS, EstimatorName
from flexcal.errors import InputError
from flexcal.printable import quoted

if TYPE_CHECKING:
    from flexcal.jobs.dynamics import DynamicsIdentification

_SPRINGS = (".drive.stiffness", ".drive.damping", ".bearing_x.", ".bearing_y.")
_ESTIMATORS = "\n".join(f"{name}: {estimator.summary}." for name, estimator in ESTIMATORS.items())
_LEARNING = (
    "Learn the residual torque of each motor as a function of its position, speed and torque (needs scikit-learn). "
    "Written to learned_residual.npz beside the estimates where it reduces the cross-validation error; "
    "the estimates are not changed."
)


@dataclass(frozen=True)
class IdentifyDynamics:
    """Identify link inertials, rotor inertias and friction (base parameters) from joint logs of exciting motion.

    Writes estimates.yaml beside robot.yaml. Parameters that are not identifiable keep their CAD values and are absorbed by others:
    the torques of the whole robot are right, but a single mass or inertia need not be. With --estimator sdp the inertials of every link
    are physically consistent and as close to CAD as the torques allow, as springs and a URDF need.
    """

    robot: Robot
    logs: Annotated[
        Positional[Paths],
        file_argument("LOGS...", "joint logs (CSV or Parquet), one or several"),
    ]
    hold_out: Annotated[str, arg(metavar="last:SHARE", help_behavior_hint="(for example last:0.3)")] = ""
    """Hold out this last fraction of every log, and predict its torques."""
    validate: Annotated[Paths, arg(metavar="LOG...", help_behavior_hint="")] = ()
    """Logs outside the fit whose torques are predicted."""
    estimator: Annotated[
        EstimatorName,
        arg(help=_ESTIMATORS),
    ] = "wls"
    flexible: bool = False
    """Use separate motor and arm equations for elastic joints, and identify the drive stiffness; needs logs with the arm side (qa1…).
    With the tilts of the bearings too (qax1…, qay1…) their stiffness is identified."""
    learn_residual: Annotated[bool, arg(help=_LEARNING)] = False
    prior: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="")] = None
    """Prior of the friction from other robots of the model, as 'flexcal fleet --prior' writes it; not used where it does not fit."""
    accept: Accept = ()
    jobs: Jobs = 1
    on: On = None
    out: EstimatesFolder = None
    json: Json = False

    def run(self) -> None:
        """Fit, and print the base parameters and the error of the torques."""
        from flexcal.cli.tables.results import (
            base_parameter_table,
            friction_table,
            learned_table,
            quantity_table,
        )
        from flexcal.jobs.dynamics import identify_robot_dynamics
        from flexcal.jobs.logs import preprocessing_remarks
        from flexcal.report.checks import check_external, check_fit, check_weight_shares

        require_robot_and_files(self.robot, self.logs, "LOGS")
        share = _share(self.hold_out)
        if share and self.validate:
            raise InputError("E-CLI-026", "--hold-out and --validate exclude each other; give one of them.")
        console = Console(self.json)
        with console.progress() as progress:
            dynamics = identify_robot_dynamics(
                self.robot,
                self.logs,
                hold_out=share,
                validate=self.validate,
                estimator=self.estimator,
                flexible=self.flexible,
                learn_residual=self.learn_residual,
                accept_weight="weight" in self.accept,
                prior=self.prior,
                out=self.out,
                command=command_line(),
                jobs=self.jobs,
                on=self.on,
                progress=progress,
            )
        document = dynamics.document()
        console.show(base_parameter_table(document["base_parameters"]))
        if self.flexible:
            springs = {
                name: q for name, q in document["parameters"].items() if any(key in name for key in _SPRINGS)
            }
            units = {item.name: item.unit for item in dynamics.estimate.parameters}
            console.show(quantity_table("drives of the elastic joints", springs, units))
        console.say(
            f"{document['rank']} of {dynamics.train.base.rank} base parameters from {document['equations']} equations; "
            f"{document['masked_rows']} rows at standstill left out"
        )
        for sentence in preprocessing_remarks(document["signals"]):
            console.say(sentence)
        if document["friction_tried"]:
            console.show(friction_table(document["friction_tried"]))
        console.say(f"friction: {', '.join(dynamics.friction.labels)}")
        if document["selection_remark"]:
            console.say(document["selection_remark"])
        error = document["error_percent"]
        console.say(f"relative torque error: {error['train']:.2f} % in the fit")
        if large := check_fit(error["train"]):
            console.say(f"warning: {large.answer}")
        if error["held_out"] is not None:
            console.say(f"relative torque error: {error['held_out']:.2f} % on data outside the fit")
        if learned := document["learned_residual"]:
            console.show(learned_table(learned["motors"]))
            console.say(_learned(learned))
        essential = document["essential_parameters"]
        console.say(
            f"relative torque error with the {len(essential['parameters'])} essential parameters alone: "
            f"{essential['error_percent']['train']:.2f} %"
        )
        if dynamics.bodiless:
            console.say(
                f"the inertials of {', '.join(dynamics.bodiless)} are not physically consistent: predicted torques do not depend on it, "
                "but springs and a URDF need consistent ones; use --estimator sdp"
            )
        for remark in (*document["remarks"], *document["notes"]):
            console.say(remark)
        if shares := document["weight_shares"]:
            weight = check_weight_shares(shares, document["weight_compared"])
            console.say(f"{weight.question} {weight.answer}")
        if (share := document["external_share"]) and (sensor := check_external(share)).status != "good":
            console.say(sensor.answer)
        console.say(dynamics.trust.sentence)
        console.say(f"wrote {dynamics.estimates}")
        if learned and learned["file"]:
            console.say(f"wrote {learned['file']}")
        if self.out is not None:
            console.say(f"wrote {self.out / 'report.html'}")
        console.finish(document, self._next(dynamics))

    def _next(self, dynamics: DynamicsIdentification) -> str:
        """Payload and frequency responses for an elastic robot; else validation, the payload where one is declared, and then a URDF if the
        inertials are physically consistent."""
        where = estimates_option(self.out)
        model = dynamics.train.observation.model
        payload = f"record logs with the payload and flexcal identify payload {quoted(self.robot)} LOADED.parquet{where}"
        if model.elastic:
            return after_dynamics(self.robot, model, payload)
        verb = f"flexcal identify dynamics {quoted(self.robot)} {' '.join(map(quoted, self.logs))}"
        if not (self.hold_out or self.validate):
            kept = "" if self.estimator == "wls" else f" --estimator {self.estimator}"
            return f"{verb} --validate other.parquet{kept}"
        if dynamics.bodiless:
            return f"{verb} --estimator sdp" + (f" --hold-out {self.hold_out}" if self.hold_out else "")
        urdf = f"flexcal export urdf {quoted(self.robot)}{where} --out identified.urdf"
        return urdf if model.payload is None else f"{payload}; or {urdf}"


def _share(text: str) -> float:
    """Fraction in `last:SHARE`, 0 for none; raises `InputError` for anything else."""
    if not text:
        return 0.0
    kind, _, number = text.partition(":")
    try:
        share = float(number)
    except ValueError:
        share = -1.0
    if kind != "last" or not 0 < share < 1:
        raise InputError(
            "E-CLI-027", f"--hold-out is '{text}'; write for example last:0.3, a share between 0 and 1."
        )
    return share


def _learned(learned: Mapping[str, Any]) -> str:
    """Reduction of the relative torque error by the learned residual, in words."""
    if not learned["file"]:
        return "no residual model was kept: it reduced the cross-validation error of no motor"
    kinds = {"cross_validation": "in cross-validation", "held_out": "on data outside the fit"}
    told = (
        f"{error['with']:.2f} % instead of {error['without']:.2f} % {where}"
        for kind, where in kinds.items()
        if (error := learned["error_percent"][kind]) is not None
    )
    return f"with the learned residual the relative torque error is {' and '.join(told)}"
