"""Calibration from measured positions: rigid fit, selection of terms, final fit, and estimates.yaml."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.calibration.diagnostics import (
    BearingAxes,
    Drift,
    compare_bearings,
    gravity_loads,
    is_implausible,
)
from flexcal.calibration.error_model import TRANSMISSION, ErrorStatistics
from flexcal.calibration.fit import (
    PER_JOINT,
    GeometricFit,
    LossName,
    StratifiedSample,
    all_errors,
    fit_geometry,
    point_uncertainty,
    probable_robot,
)
from flexcal.calibration.measurement import require_points
from flexcal.calibration.term_selection import (
    CrossValidation,
    TermSelection,
    considered_document,
    cross_validated,
    select_terms,
)
from flexcal.calibration.verification import (
    CALIBRATED,
    RIGID,
    MeasuredPoints,
    UncalibratedErrors,
    arms_at,
    errors_before,
    uncalibrated_model,
)
from flexcal.data.poses import read_poses
from flexcal.errors import FlexcalError
from flexcal.estimation import Estimate
from flexcal.files.formats import json_values, provenance, read_estimates
from flexcal.jobs.calibration.fitted_measurements import measurement_digests
from flexcal.jobs.calibration.joint_ranges import joint_extents
from flexcal.jobs.calibration.remarks import calibration_remarks, outliers_of
from flexcal.jobs.calibration.subsample import calibration_subsample_remark, subsample_document
from flexcal.jobs.inputs import TARGETS, TARGETS_BETWEEN, require_distinct_files
from flexcal.jobs.pages import report_folder
from flexcal.jobs.result_files import (
    estimates_target,
    header,
    identifiability_block,
    identifiability_spectrum,
    quantities,
    store_block,
    write_arm,
    write_loads,
    write_points,
    write_results,
)
from flexcal.jobs.stiffness import bearing_remarks, bearings_block
from flexcal.model.kinematics import found_xyz
from flexcal.model.robot import RobotModel, with_blocks
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, misfit_document, misfit_sentences
from flexcal.report.pages import calibration_checks
from flexcal.units import MILLIMETRE

AUTO = "auto"


@dataclass(frozen=True, eq=False)
class Calibration:
    """What `calibrate_robot` found.

    `before` are the errors of the uncalibrated robot; `rigid` is the fit without elasticity and further terms, `selected` the one that is
    stored in the file `estimates`; `selection`, and `validated`, the errors of `selected` at poses left out, are None where the terms were
    given. `command` is the command line, where there was one. `bearings` says which bearing axes the points prefer; `stiffness` is what
    stage 1 left in the estimates, where it did. Of more points than a fit takes, `sample` says which were fitted, and `everywhere` are the
    errors of `selected` at all of them.
    """

    before: UncalibratedErrors
    rigid: GeometricFit
    selection: TermSelection | None
    selected: GeometricFit
    estimate: Estimate
    estimates: Path
    command: str = ""
    bearings: BearingAxes | None = None
    stiffness: Estimate | None = None
    validated: CrossValidation | None = None
    sample: StratifiedSample | None = None
    everywhere: ErrorStatistics | None = None

    @property
    def points(self) -> MeasuredPoints:
        """The points of the fit with the errors of every model, the rigid one where it is not the selected."""
        fit = self.selected
        errors = errors_before(self.before) | {RIGID: self.rigid.residuals, CALIBRATED: fit.residuals}
        if self.rigid is fit:
            del errors[RIGID]
        return MeasuredPoints(fit.poses, errors, fit.ambiguous)

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(calibration_checks(json_values(self._numbers), self.estimate, self.points))

    def document(self) -> dict[str, Any]:
        """The content of results.json; `identifiability` is that of kinematics and backlash, within it `selected` of all terms."""
        return {**header("calibration"), **self._numbers, "verdict": self.trust.document()}

    @cached_property
    def found_points(self) -> dict[str, dict[str, Any]]:
        """The measured points: their frames, and where they are in it, m, as declared and as found, with the 1σ distance of the latter."""
        fit = self.selected
        targets = fit.poses.targets
        robot = probable_robot(fit.model, targets)
        return {
            name: {
                "frame": fit.model.points[name].frame,
                "declared_xyz_m": fit.model.points[name].xyz,
                "found_xyz_m": found_xyz(robot, name),
                "std_m": point_uncertainty(robot, name),
            }
            for name in targets
        }

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        selected, chosen, before = self.selected, self.selection, self.before.document()
        identifiability, drift = selected.identifiability, Drift.of(selected)
        bearings = bearing_remarks(self.bearings, selected)
        blamed = self.bearings is not None and self.bearings.contradicted
        misfit = None if self.stiffness is None else self.stiffness.misfit
        return {
            "robot": selected.model.name,
            "joints": {joint.name: joint.kind for joint in selected.model.joints},
            "identifiability": identifiability_block(self.rigid.identifiability)
            | {
                "selected": identifiability_block(identifiability)
                | identifiability_spectrum(identifiability)
                | {"undetermined": [{"name": u.name, "cause": u.cause} for u in selected.undetermined]}
            },
            "terms": list(selected.terms),
            "term_selection": [considered_document(row) for row in chosen.considered] if chosen else [],
            "term_selection_by": chosen.by if chosen else None,
            "cross_validation": None
            if self.validated is None
            else {
                "by": self.validated.by,
                "mean_mm": self.validated.mean / MILLIMETRE,
                "parameters": self.validated.freedom,
            },
            "before": before,
            "points": self.found_points,
            "calibration": {
                "nominal": before["registered"],
                "rigid": self.rigid.errors.in_millimetres(),
                "selected": selected.errors.in_millimetres(),
            },
            "fit": {
                "status": selected.estimate.status,
                "reduced_chi2": selected.estimate.reduced_chi2,
                "sigma_given": selected.poses.sigma_given,
                "sigma_mm": float(np.sqrt(np.mean(selected.poses.sigma**2))) / MILLIMETRE,
                "ambiguous_poses": int(selected.ambiguous.sum()),
                "is_implausible": is_implausible(selected),
            },
            "variances": selected.variances,
            "drift": drift.document(),
            "sample": subsample_document(self.sample, self.everywhere),
            "outliers": [
                {"pose": o.pose, "target": o.target, "error_mm": o.error / MILLIMETRE}
                for o in outliers_of(selected)
            ],
            "bearings": bearings_block(self.bearings),
            "stage1": None if self.stiffness is None else {"misfit": misfit_document(self.stiffness.misfit)},
            "remarks": [
                *calibration_subsample_remark(self.sample, self.everywhere),
                *([chosen.remark] if chosen and chosen.remark else []),
                *calibration_remarks(selected, bearings if blamed else ()),
                *(() if blamed else bearings),
                *(
                    []
                    if misfit is None
                    else [f"the springs of stage 1 are doubtful: {misfit_sentences(misfit).rstrip('.')}"]
                ),
            ],
            "parameters": quantities(self.estimate),
            "estimates": self.estimates,
            "command": self.command,
        }


def calibrate_robot(
    robot: Path,
    files: Sequence[Path],
    *,
    terms: Sequence[str] | None = None,
    loss: LossName = "auto",
    secant_scale: float = 0.0,
    elasticity: Literal["reestimated", "marginalised"] = "reestimated",
    out: Path | None = None,
    command: str = "",
    progress: Progress = silent,
) -> Calibration:
    """Calibrate the robot of a robot.yaml on files of measured poses, and store the estimate as its block `calibration`.

    The robot starts from nominal and the other blocks of its estimates; stiffness found by stage 1 enters with its uncertainty. `terms`
    (None: as robot.yaml says) are names, or "auto" for those that cross-validation supports. A sigma in the files is that of the
    instrument; the scatter of robot and model are found from the points.

    With `out`, estimates, results.json, points.csv, arm.npz, gravity_loads.npz and report.html go to that folder, and nothing beside
    robot.yaml changes. Raises `FlexcalError` as reading and `fit_geometry` do; nothing is written then.
    """
    progress("reading", 0.0)
    require_distinct_files(files)
    bare = RobotModel.from_yaml(robot, estimates=False)
    source = bare.path.parent / bare.config.estimates
    blocks = read_estimates(source, without="calibration") if source.exists() else {}
    target = estimates_target(source, out, "calibration")
    model = with_blocks(bare, blocks, source)
    measured = read_poses(list(files), model)
    require_points(measured, " and ".join(str(file) for file in files))
    sample = StratifiedSample.of(measured)
    poses = measured if sample is None else measured.subset(sample.rows)
    wanted = _terms(model, terms)
    progress("reading", 1.0)

    def fit(robot_: RobotModel, chosen: Sequence[str], stage: str, *, elastic: bool) -> GeometricFit:
        progress(stage, 0.0)
        calibration = fit_geometry(
            robot_,
            poses,
            terms=chosen,
            elastic=elastic,
            elasticity=elasticity,
            secant_scale=secant_scale,
            loss=loss,
        )
        progress(stage, 1.0)
        return calibration

    base = ("kinematic", "backlash") if model.backlash_joints else ("kinematic",)
    rigid = fit(model, base, "rigid fit", elastic=False)
    bearings = compare_bearings(
        model, lambda robot_: fit(robot_, (*base, TRANSMISSION), "bearing axes", elastic=True)
    )
    if bearings is not None and bearings.declared is None and bearings.preferred is not None:
        model = model.with_bearings(bearings.preferred)
    selection = None
    if wanted is None:
        progress("terms", 0.0)
        good = np.setdiff1d(np.arange(len(poses)), rigid.estimate.outliers)
        selection = select_terms(model, poses.subset(good))
        progress("terms", 1.0)
        model, wanted = selection.model, _with_random_waves(selection.terms)
    elastic = bool(model.elastic)
    same = not elastic and tuple(wanted) == base
    selected = rigid if same else fit(model, wanted, "selected fit", elastic=elastic)
    options = {
        "terms": " ".join(wanted),
        "loss": loss,
        "secant_scale": secant_scale,
        "elasticity": elasticity,
        TARGETS: TARGETS_BETWEEN.join(poses.targets),
    } | ({"bearings": model.bearings} if model.has_bearings else {})
    origin = provenance([robot, bare.urdf, *files], options, source if blocks else None, tuple(blocks))
    estimate = replace(
        selected.estimate,
        provenance=origin,
        ranges=joint_extents(selected.model, selected.poses.q),
        measurements=measurement_digests(poses),
    )
    before = uncalibrated_model(model, poses).errors(poses)
    result = Calibration(
        before,
        rigid,
        selection,
        selected,
        estimate,
        target,
        command,
        bearings,
        blocks.get("stiffness"),
        None if selection is None else cross_validated(selected),
        sample,
        None if sample is None else all_errors(selected.model, measured, progress),
    )
    store_block(source, target, blocks, "calibration", estimate)
    if out is not None:
        progress("report", 0.0)
        write_results(out, result.document())
        write_points(out, result.points)
        write_arm(out, arms_at(selected.model, selected.poses, result.points.shown))
        fits = {
            name: result.points.errors[name] for name in (RIGID, CALIBRATED) if name in result.points.errors
        }
        write_loads(out, gravity_loads(selected, fits))
        report_folder(out)
        progress("report", 1.0)
    return result


def _with_random_waves(terms: Sequence[str]) -> tuple[str, ...]:
    """Selected terms with all transmission errors as random effects, in place of those of single orders."""
    return (*(term for term in terms if not term.startswith(TRANSMISSION)), TRANSMISSION)


def _terms(model: RobotModel, given: Sequence[str] | None) -> tuple[str, ...] | None:
    """The terms to fit, None for those that cross-validation supports."""
    declared = model.config.geometry.terms
    asked = tuple(given) if given else ((declared,) if isinstance(declared, str) else declared)
    if asked == (AUTO,):
        return None
    harmonics = tuple(f"transmission_{order}" for order in model.drives.harmonics)
    known = ("kinematic", "backlash", *PER_JOINT, TRANSMISSION, *harmonics)
    for term in asked:
        owner, _, kind = term.rpartition(".")
        if owner:
            model.joint_index(owner)
        if kind not in (PER_JOINT if owner else known):
            raise FlexcalError(
                "E-RUN-011",
                f"there is no geometry term '{term}'; there are {', '.join(known)}, or {AUTO} alone.",
            )
    if "backlash" in asked and not model.backlash_joints:
        raise FlexcalError(
            "E-RUN-012",
            f"the term backlash is asked for but {model.path} names no joint with it; add `geometry: {{backlash: [joint]}}`.",
        )
    return tuple(dict.fromkeys(["kinematic", *asked]))
