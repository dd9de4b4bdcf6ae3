"""`flexcal identify stiffness`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from flexcal.cli.arguments.invocation import command_line
from flexcal.cli.arguments.shared_options import (
    EstimatesFolder,
    Json,
    MaybePath,
    Paths,
    Robot,
    Seed,
    file_argument,
    require_robot_and_files,
)
from flexcal.cli.arguments.suggested_commands import stored_lines
from flexcal.cli.terminal.console import Console
from flexcal.printable import quoted

_CHECK = "check that responses, payload and poses are of this robot, and the start values under `elastic:`"
_OTHER_START = {
    "multi-start": f"search a start more widely with --search population; if that ends so too, {_CHECK}",
    "population": f"try another --seed; if that ends so too, {_CHECK}",
}


@dataclass(frozen=True)
class IdentifyStiffness:
    """Identify stiffness and damping of drives and bearings from frequency responses.

    Writes estimates.yaml beside robot.yaml, which 'calibrate' then uses. Link inertias, rotor inertias, friction and delays are estimated
    too, with CAD as the prior.
    """

    robot: Robot
    responses: Annotated[
        Positional[Paths],
        file_argument("RESPONSES...", "files of 'identify response', or their folder"),
    ]
    inertias_known: bool = False
    """Take link inertias as exact."""
    weighting: Literal["covariance", "paper", "uniform"] = "covariance"
    """covariance: that of the measured responses, the narrowest intervals; paper: emphasis near poles and zeros; uniform: equal weights."""
    search: Literal["multi-start", "population"] = "multi-start"
    """Search for a start: multi-start with gradients, or differential evolution in place of the paper's genetic algorithm."""
    seed: Seed = 0
    """Seed of the search for a start."""
    prior: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="")] = None
    """Prior of the stiffness from other robots of the model, as 'flexcal fleet --prior' writes it; not used where it does not fit."""
    out: EstimatesFolder = None
    json: Json = False

    def run(self) -> None:
        """Fit, and print the springs."""
        from flexcal.cli.tables.results import quantity_table
        from flexcal.jobs.stiffness import identify_robot_stiffness

        require_robot_and_files(self.robot, self.responses, "RESPONSES")
        console = Console(self.json)
        with console.progress() as progress:
            stiffness = identify_robot_stiffness(
                self.robot,
                self.responses,
                inertias_known=self.inertias_known,
                weighting=self.weighting,
                search=self.search,
                seed=self.seed,
                prior=self.prior,
                out=self.out,
                command=command_line(),
                progress=progress,
            )
        document = stiffness.document()
        quantities = document["parameters"]
        units = {item.name: item.unit for item in stiffness.estimate.parameters}
        for title, ending in (("stiffness", ".stiffness"), ("damping", ".damping")):
            shown = {name: values for name, values in quantities.items() if name.endswith(ending)}
            console.show(quantity_table(title, shown, units))
        fit = document["fit"]
        if fit["status"] != "converged":
            console.say(
                f"the fit has not converged ({fit['message']}), so its values and intervals mean nothing: {_OTHER_START[self.search]}"
            )
        if not fit["reference_motion_modelled"]:
            console.say(
                "there is no plan.yaml beside the responses: the reference motion is ignored, which biases damping upwards"
            )
        if fit["missing_poses"]:
            numbers = ", ".join(map(str, fit["missing_poses"]))
            console.say(f"poses of the plan without a response, not used in the fit: {numbers}")
        if fit["reduced_chi2"] is not None:
            console.say(
                f"chi-square over its expectation: {fit['reduced_chi2']:.2f} (near 1 where model and noise are right)"
            )
        for remark in stiffness.remarks:
            console.say(remark)
        console.say(stiffness.trust.sentence)
        for line in stored_lines(self.robot, stiffness.estimates, self.out):
            console.say(line)
        console.finish(document, f"flexcal design poses {quoted(self.robot)} --count 40 --out poses.yaml")
