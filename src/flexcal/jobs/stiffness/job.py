"""Identification of stiffness and damping from a robot.yaml and files, and estimates.yaml."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from flexcal.elasticity.identification import MultiStart, PopulationSearch, Search
from flexcal.elasticity.response_model import (
    CovarianceWeighting,
    ResonanceWeighting,
    UniformWeighting,
    Weighting,
)
from flexcal.files.formats import provenance, read_estimates, sha256_of
from flexcal.jobs.fleet_prior import FLEET, read_model_prior
from flexcal.jobs.inputs import common_plan, plan_files, read_responses
from flexcal.jobs.result_files import RunRecord, estimates_target
from flexcal.jobs.stiffness.identification import identify_stiffness
from flexcal.jobs.stiffness.result import StiffnessIdentification
from flexcal.model.robot import DECLARED, GEOMETRY, RobotModel, declared_sha256, with_blocks
from flexcal.progress import Progress, silent

WeightingName = Literal["covariance", "paper", "uniform"]
SearchName = Literal["multi-start", "population"]

_WEIGHTINGS: dict[WeightingName, Weighting] = {
    "covariance": CovarianceWeighting(),
    "paper": ResonanceWeighting(),
    "uniform": UniformWeighting(),
}
_SEARCHES: dict[SearchName, Search] = {"multi-start": MultiStart(), "population": PopulationSearch()}

_GEOMETRIC = (*GEOMETRY, "backlash")
"""Parameters of the calibration that stage 1 does not estimate itself."""


def identify_robot_stiffness(
    robot_file: Path,
    files: Sequence[Path],
    *,
    inertias_known: bool = False,
    weighting: WeightingName = "covariance",
    search: SearchName = "multi-start",
    seed: int = 0,
    prior: Path | None = None,
    out: Path | None = None,
    command: str = "",
    progress: Progress = silent,
) -> StiffnessIdentification:
    """`identify_stiffness` of the robot of a robot.yaml from files of responses, or folders of them, and storing of the block `stiffness`.

    The robot starts from nominal, the block `dynamics`, and the geometry of the block `calibration`; what that one says of stiffness
    and inertia came from here and is left out. The reference motion is that of plan.yaml beside the responses. With `out`, estimates,
    results.json, fitted_responses.npz and report.html go to that folder. `prior` is a file with the stiffness of other robots of the model,
    as `pool_fleet` writes it. Raises `FlexcalError` as `identify_stiffness` does; nothing is
    written then.
    """
    bare = RobotModel.from_yaml(robot_file, estimates=False)
    source = bare.estimates_file
    blocks = read_estimates(source, without="stiffness") if source.exists() else {}
    target = estimates_target(bare, out, "stiffness")
    model = with_blocks(bare, {block: e for block, e in blocks.items() if block == "dynamics"}, source)
    calibrated = blocks.get("calibration")
    if calibrated is not None:
        geometric = {n: v for n, v in calibrated.values.items() if n.rpartition(".")[2] in _GEOMETRIC}
        model = model.with_values(geometric)
    others = None if prior is None else read_model_prior(prior, bare)
    inputs, responses = read_responses(files, bare)
    plans = plan_files(inputs)
    identified = identify_stiffness(
        model,
        responses,
        plan=common_plan(plans),
        inertias_known=inertias_known,
        weighting=_WEIGHTINGS[weighting],
        search=_SEARCHES[search],
        seed=seed,
        prior=others,
        progress=progress,
    )
    options = {"inertias_known": inertias_known, "weighting": weighting, "search": search, "seed": seed}
    options |= {"bearings": identified.model.bearings} if identified.model.has_bearings else {}
    origin = provenance(
        [robot_file, bare.urdf, *inputs, *plans], options, source if blocks else None, tuple(blocks)
    )
    origin[DECLARED] = declared_sha256(bare, ())
    if prior is not None and identified.pooled is not None and identified.pooled.used:
        origin[f"input.{FLEET}"] = sha256_of(prior)
    result = replace(
        identified,
        estimate=replace(identified.estimate, provenance=origin),
        estimates=target,
        record=RunRecord(origin, command),
    )
    result.store(source, out, blocks)
    return result
