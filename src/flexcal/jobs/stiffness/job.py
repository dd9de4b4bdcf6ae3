"""Identification of stiffness and damping from frequency responses, and estimates.yaml."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.elasticity.identification import (
    MultiStart,
    PopulationSearch,
    Search,
    StiffnessResult,
    identify_stiffness,
)
from flexcal.elasticity.response_model import (
    CovarianceWeighting,
    ResonanceWeighting,
    UniformWeighting,
    Weighting,
)
from flexcal.estimation import Estimate
from flexcal.files.formats import provenance, read_estimates
from flexcal.jobs.inputs import common_plan, plan_files, read_responses
from flexcal.jobs.result_files import (
    dropped_parameters,
    estimates_target,
    header,
    quantities,
    springs_block,
    store_block,
    write_results,
)
from flexcal.jobs.stiffness.bearing_axes import response_bearings_block
from flexcal.jobs.stiffness.remarks import further_joints, stiffness_remarks
from flexcal.model.robot import GEOMETRY, RobotModel, with_blocks
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, misfit_document

WeightingName = Literal["covariance", "paper", "uniform"]
SearchName = Literal["multi-start", "population"]

_WEIGHTINGS: dict[WeightingName, Weighting] = {
    "covariance": CovarianceWeighting(),
    "paper": ResonanceWeighting(),
    "uniform": UniformWeighting(),
}
_SEARCHES: dict[SearchName, Search] = {"multi-start": MultiStart(), "population": PopulationSearch()}

_GEOMETRIC = (*GEOMETRY, "backlash")
"""What the calibration knows that stage 1 does not estimate itself."""


@dataclass(frozen=True, eq=False)
class RobotStiffness:
    """The result of stage 1 of the robot of that name, whether it knew the reference motion, the numbers of the plan's poses without a
    response, the joints that got a spring though robot.yaml holds them rigid, remarks, the file that its estimate was written to, and the
    command line."""

    robot: str
    result: StiffnessResult
    reference_known: bool
    missing_poses: tuple[int, ...]
    further_joints: tuple[str, ...]
    remarks: tuple[str, ...]
    estimate: Estimate
    estimates: Path
    command: str = ""

    @property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        from flexcal.report.pages import stiffness_checks

        return Trust(stiffness_checks(self.estimate, response_bearings_block(self.result.bearings)))

    def document(self) -> dict[str, Any]:
        """The content of results.json."""
        estimate = self.estimate
        return {
            **header("stiffness"),
            "stage1": springs_block(estimate),
            "fit": {
                "status": estimate.status,
                "message": estimate.message,
                "reduced_chi2": estimate.reduced_chi2,
                "misfit": misfit_document(estimate.misfit),
                "rank": estimate.rank,
                "reference_motion_modelled": self.reference_known,
                "missing_poses": list(self.missing_poses),
                "dropped": dropped_parameters(estimate.dropped),
            },
            "bearings": response_bearings_block(self.result.bearings),
            "further_joints": list(self.further_joints),
            "remarks": list(self.remarks),
            "parameters": quantities(estimate),
            "verdict": self.trust.document(),
            "robot": self.robot,
            "estimates": self.estimates,
            "command": self.command,
        }


def identify_robot_stiffness(
    robot: Path,
    files: Sequence[Path],
    *,
    inertias_known: bool = False,
    weighting: WeightingName = "covariance",
    search: SearchName = "multi-start",
    seed: int = 0,
    out: Path | None = None,
    command: str = "",
    progress: Progress = silent,
) -> RobotStiffness:
    """Fit the springs of a robot.yaml to frequency responses (files, or folders of them), and store the block `stiffness`.

    The robot starts from nominal, the block `dynamics`, and the geometry of the block `calibration`; what that one says of stiffness
    and inertia came from here and is left out. The reference motion is that of plan.yaml beside the responses. With `out`, estimates,
    results.json and report.html go to that folder. `seed` is that of the search for a start. Raises `FlexcalError` where responses do
    not fit the robot; nothing is written then.
    """
    bare = RobotModel.from_yaml(robot, estimates=False)
    source = bare.path.parent / bare.config.estimates
    blocks = read_estimates(source, without="stiffness") if source.exists() else {}
    target = estimates_target(source, out, "stiffness")
    model = with_blocks(bare, {block: e for block, e in blocks.items() if block == "dynamics"}, source)
    calibrated = blocks.get("calibration")
    if calibrated is not None:
        geometric = {n: v for n, v in calibrated.values.items() if n.rpartition(".")[2] in _GEOMETRIC}
        model = model.with_values(geometric)
    inputs, responses = read_responses(files, bare)
    plans = plan_files(inputs)
    plan = common_plan(plans)
    result = identify_stiffness(
        model,
        responses,
        rng=np.random.default_rng([seed, 1]),
        inertias_known=inertias_known,
        plan=plan,
        weighting=_WEIGHTINGS[weighting],
        search=_SEARCHES[search],
        progress=progress,
    )
    if result.bearings is not None:
        model = model.with_bearings(result.bearings.taken)
    options = {"inertias_known": inertias_known, "weighting": weighting, "search": search, "seed": seed}
    options |= {"bearings": model.bearings} if model.has_bearings else {}
    origin = provenance(
        [robot, bare.urdf, *inputs, *plans], options, source if blocks else None, tuple(blocks)
    )
    estimate = replace(result.estimate, provenance=origin)
    seen = {response.pose for response in responses}
    missing = () if plan is None else tuple(k + 1 for k in range(len(plan.poses)) if k not in seen)
    identified = RobotStiffness(
        bare.name,
        result,
        plan is not None,
        missing,
        further_joints(estimate, bare),
        stiffness_remarks(result, bare),
        estimate,
        target,
        command,
    )
    store_block(source, target, blocks, "stiffness", estimate)
    if out is not None:
        from flexcal.jobs.pages import report_folder
        from flexcal.jobs.result_files import write_fitted_responses
        from flexcal.report.results import fitted_responses

        write_fitted_responses(out, fitted_responses(result, model))
        write_results(out, identified.document())
        report_folder(out)
    return identified
