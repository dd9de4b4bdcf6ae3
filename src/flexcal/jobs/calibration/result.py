"""Result of a calibration, and the content of its results.json."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from flexcal.calibration.diagnostics import (
    BearingAxes,
    Coupling,
    Drift,
    FleetConflict,
    LearningCurve,
    PlaceAgreement,
    ReadingLag,
    RepeatabilityFloor,
    RobotSize,
    SensorLag,
    gravity_loads,
    is_implausible,
    stated_noise,
    undeclared_coupling,
)
from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import (
    GeometricFit,
    StratifiedSample,
    point_uncertainty,
    probable_robot,
)
from flexcal.calibration.term_selection import (
    CONDITIONAL,
    CrossValidation,
    TermSelection,
    considered_document,
)
from flexcal.calibration.verification import (
    CALIBRATED,
    MILLIRADIAN,
    RIGID,
    MeasuredPoints,
    MeasuredTilts,
    OrientationErrors,
    TiltStatistics,
    UncalibratedErrors,
    arms_at,
    errors_before,
    orientation_document,
)
from flexcal.estimation import Estimate
from flexcal.files.formats import Block, json_values
from flexcal.jobs.calibration.approaches import Approaches
from flexcal.jobs.calibration.extent import Extent
from flexcal.jobs.calibration.held_out import HeldOut
from flexcal.jobs.calibration.held_out_tilts import HeldOutTilts
from flexcal.jobs.calibration.inclinations import inclination_document
from flexcal.jobs.calibration.prior_of_fleet import contradicts, fleet_document, fleet_remarks
from flexcal.jobs.calibration.remarks import calibration_remarks, floor_remark, lag_remark, outliers_of
from flexcal.jobs.calibration.sockets import base_remark, place_remarks
from flexcal.jobs.calibration.subsample import calibration_subsample_remark, subsample_document
from flexcal.jobs.calibration.thermal import thermal_document
from flexcal.jobs.inputs import REFUSED, CalibratedRobot
from flexcal.jobs.pages import Identification
from flexcal.jobs.result_files import (
    header,
    identifiability_block,
    identifiability_spectrum,
    quantities,
    write_arm,
    write_loads,
    write_points,
    write_tilts,
)
from flexcal.jobs.stiffness import bearing_remarks, bearings_block
from flexcal.model.kinematics import found_xyz
from flexcal.model.robot import RobotModel
from flexcal.report.checks import (
    Trust,
    calibration_checks,
    inclination_checks,
    misfit_document,
    misfit_sentences,
)
from flexcal.units import MILLIMETRE

if TYPE_CHECKING:
    from flexcal.jobs.fleet_prior import PooledUse


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Identification):
    """Result of `calibrate`: the calibrated robot, its errors before and after, and its uncertainty.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot.
    estimate : Estimate
        Geometric parameters, with stiffness and inertia as prior and points together determine them.
    nominal : RobotModel
        The robot before.
    before : UncalibratedErrors
        Errors of the robot before.
    rigid : GeometricFit
        Fit without elasticity and further terms.
    selection : TermSelection or None
        Cross-validation of the terms; None where they were given.
    selected : GeometricFit
        The fit that `estimate` is of.
    bearings : BearingAxes or None
        Which bearing axes the points prefer.
    stiffness : Estimate or None
        What stage 1 left in the estimates, where they were read from a file.
    validated : CrossValidation or None
        Errors of `selected` at poses left out; None where the terms were given.
    sample : StratifiedSample or None
        Which points were fitted, where there are more than a fit takes.
    everywhere : ErrorStatistics or None
        Errors of `selected` at all points, where a sample was fitted.
    held_out : HeldOut, HeldOutTilts or None
        Errors at groups of measurements that were left out whole, where they were asked for.
    orientation_before : OrientationErrors or None
        Errors of the orientations of the uncalibrated robot, where they were measured.
    conflict : FleetConflict or None
        Test of the prior from other robots of the model, where there is one.
    extent : Extent or None
        Predicted errors near the poses and where the robot will work; None where none can be predicted.
    pooled_stiffness : PooledUse or None
        Stiffness from other robots of the model, in place of one that was identified.
    estimates : Path or None
        File that the estimate was stored in.
    command : str
        The command line, where there was one.
    """

    block: ClassVar[Block] = "calibration"
    nominal: RobotModel
    before: UncalibratedErrors
    rigid: GeometricFit
    selection: TermSelection | None
    selected: GeometricFit
    bearings: BearingAxes | None = None
    stiffness: Estimate | None = None
    validated: CrossValidation | None = None
    sample: StratifiedSample | None = None
    everywhere: ErrorStatistics | None = None
    held_out: HeldOut | HeldOutTilts | None = None
    orientation_before: OrientationErrors | None = None
    conflict: FleetConflict | None = None
    extent: Extent | None = None
    pooled_stiffness: PooledUse | None = None
    estimates: Path | None = None
    command: str = ""

    @property
    def robot(self) -> CalibratedRobot:
        """Calibrated robot with the nominal one, as `verify`, `predict`, `compensate` and `accuracy_map` take it."""
        return CalibratedRobot(self.nominal, self.model, {self.block: self.marked().estimate})

    def marked(self) -> Calibration:
        """The same, with the reason in the provenance of its estimate where the verdict is no, for what later uses the estimate."""
        trust = self.trust
        if trust.status != "bad":
            return self
        origin = {**self.estimate.provenance, REFUSED: trust.because}
        marked = replace(self, estimate=replace(self.estimate, provenance=origin))
        # no provenance changes these, and they take as long as a fit
        for name in ("coupling", "lag", "_numbers"):
            vars(marked)[name] = getattr(self, name)
        return marked

    @property
    def residuals(self) -> np.ndarray:
        """Measured minus predicted positions (N, 3), m, at the poses of the fit."""
        return self.selected.residuals

    @property
    def errors(self) -> ErrorStatistics:
        """Distances between predicted and measured points at the poses of the fit."""
        return self.selected.errors

    @property
    def headline(self) -> str:
        """Errors at the poses of the fit."""
        if self.tilts is not None and not len(self.selected.poses.pointed):
            after = TiltStatistics.of(self.tilts.calibrated)
            return f"{after.rms / MILLIRADIAN:.3g} mrad rms of {after.poses} readings of inclinometers"
        return str(self.errors)

    def summary(self) -> str:
        """Errors, terms, remarks and verdict."""
        conditional = () if self.selection is None else (CONDITIONAL,)
        return "\n".join(
            [self.selected.summary(), *conditional, *self._numbers["remarks"], self.trust.sentence]
        )

    def write_arrays(self, folder: Path) -> None:
        """Leave points.csv, arm.npz and gravity_loads.npz in a folder, tilts.csv where there are readings of inclinometers."""
        if self.tilts is not None:
            write_tilts(folder, self.tilts)
        if not len(self.selected.poses.pointed):
            return
        points, selected = self.points, self.selected
        write_points(folder, points)
        write_arm(folder, arms_at(selected.model, selected.poses.pointed, points.shown))
        fits = {name: points.errors[name] for name in (RIGID, CALIBRATED) if name in points.errors}
        write_loads(folder, gravity_loads(selected, fits))

    @property
    def points(self) -> MeasuredPoints:
        """Points of the fit with the errors of every model; includes the rigid model if it is not the selected one."""
        fit = self.selected
        errors = errors_before(self.before) | {
            RIGID: self.rigid.residuals[~self.rigid.poses.tilted],
            CALIBRATED: fit.residuals[~fit.poses.tilted],
        }
        if self.rigid is fit:
            del errors[RIGID]
        return MeasuredPoints.of_fit(fit, errors)

    @cached_property
    def tilts(self) -> MeasuredTilts | None:
        """Readings of inclinometers beside the robot's; None where there are none."""
        fit = self.selected
        return MeasuredTilts.of(self.nominal, fit.poses, fit.tilts) if fit.poses.tilted.any() else None

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        if self.tilts is not None and not len(self.selected.poses.pointed):
            after = TiltStatistics.of(self.tilts.calibrated)
            return Trust(inclination_checks(json_values(self._numbers), self.estimate, after))
        return Trust(calibration_checks(json_values(self._numbers), self.estimate, self.points))

    def document(self) -> dict[str, Any]:
        """Content of results.json; `identifiability` is that of kinematics and backlash, within it `selected` of all terms."""
        return {**header("calibration"), **self._numbers, "verdict": self.trust.document()}

    @cached_property
    def found_points(self) -> dict[str, dict[str, Any]]:
        """Measured points: frame, and position in it, m, declared and calibrated, with the 1σ distance of the latter."""
        fit = self.selected
        targets = fit.poses.pointed.targets
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
    def coupling(self) -> Coupling | None:
        """Coupled drive that robot.yaml does not declare, where that is why the points are not met."""
        return undeclared_coupling(self.nominal, self.selected)

    @cached_property
    def lag(self) -> ReadingLag | None:
        """Whether points and joint positions were read at different instants while the robot moved; None where the rows cannot tell."""
        return ReadingLag.of(self.selected)

    @property
    def is_implausible(self) -> bool:
        """Whether data and robot are inconsistent, so that the calibration must not be used."""
        return self.coupling is not None or is_implausible(self.selected)

    @property
    def _cause(self) -> tuple[str, ...]:
        """Sentences on what is wrong where the points are not met."""
        blamed = self.bearings is not None and self.bearings.contradicted
        bearings = bearing_remarks(self.bearings, self.selected) if blamed else ()
        return (*bearings, *(() if self.coupling is None else (self.coupling.sentence,)))

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        selected, chosen, before = self.selected, self.selection, self.before.document()
        identifiability = selected.identifiability
        drift = Drift.of(selected) if selected.poses.located.any() else None
        noise = stated_noise(selected)
        # residuals of far more than the noise may leave no test
        drift = drift if drift is not None and np.isfinite(drift.probability) else None
        agreement, size = PlaceAgreement.of(selected), RobotSize.of(selected)
        coupling = self.coupling
        fleet = fleet_document(selected, self.conflict)
        pooled = self.pooled_stiffness
        contradicted = contradicts(fleet) or (pooled is not None and pooled.contradicted)
        lagging = self.lag is not None and self.lag.certain
        misfits = coupling is not None or contradicted or lagging
        floor = None if misfits else RepeatabilityFloor.of(selected)
        sensor_lag = SensorLag.of(selected)
        approaches = Approaches.of(selected)
        extent = self.extent
        learning = LearningCurve.of(selected)
        bearings = bearing_remarks(self.bearings, selected)
        blamed = self.bearings is not None and self.bearings.contradicted
        misfit = None if self.stiffness is None else self.stiffness.misfit
        return {
            "robot": selected.model.name,
            "joints": {joint.name: joint.kind for joint in selected.model.motor_joints},
            "identifiability": identifiability_block(self.rigid.identifiability)
            | {
                "selected": identifiability_block(identifiability)
                | identifiability_spectrum(identifiability)
                | {"undetermined": [{"name": u.name, "cause": u.cause} for u in selected.undetermined]}
                | {"by_prior": [u.name for u in selected.by_prior]}
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
                "expected_mm": self.validated.expected / MILLIMETRE,
            },
            "orientation": orientation_document(
                self.orientation_before,
                OrientationErrors(selected.rotations) if len(selected.rotations) else None,
            ),
            "inclination": None if self.tilts is None else inclination_document(selected, self.tilts),
            "held_out": None if self.held_out is None else self.held_out.document(),
            "before": before,
            "points": self.found_points,
            "calibration": {
                "nominal": before["registered"],
                "rigid": self.rigid.errors.in_millimetres(),
                "selected": selected.errors.in_millimetres(),
                "by_kind": {name: own.in_millimetres() for name, own in selected.errors_by_kind.items()},
            },
            "fit": {
                "status": selected.estimate.status,
                "reduced_chi2": noise[0].chi2 if noise else None,
                "stated_noise": [item.document() for item in noise],
                "coordinates": int(selected.linear.readings.present.sum()),
                "sigma_given": selected.poses.sigma_given,
                "sigma_mm": float(np.sqrt(np.mean(selected.poses.sigma**2))) / MILLIMETRE,
                "ambiguous_poses": int(selected.ambiguous.sum()),
                "is_implausible": self.is_implausible,
            },
            "variances": selected.variances,
            "floor": None if floor is None else floor.document(),
            "undeclared_coupling": None if coupling is None else coupling.document(),
            "drift": None if drift is None else drift.document(),
            "lag": None if self.lag is None else self.lag.document(),
            "sample": subsample_document(self.sample, self.everywhere),
            "outliers": [outlier.document() for outlier in outliers_of(selected)],
            "places": None if agreement is None else agreement.document(),
            "learning_curve": None if learning is None else learning.document(),
            "size": None if size is None else size.document(),
            "bearings": bearings_block(self.bearings),
            "fleet": fleet,
            "pooled_stiffness": None if pooled is None else pooled.document(),
            "temperature": thermal_document(selected, sensor_lag),
            "extent": None if extent is None else extent.document(),
            "approach": None if approaches is None else approaches.document(),
            "stage1": None if self.stiffness is None else {"misfit": misfit_document(self.stiffness.misfit)},
            "remarks": [
                *calibration_subsample_remark(self.sample, self.everywhere),
                *([chosen.remark] if chosen and chosen.remark else []),
                *base_remark(selected),
                *fleet_remarks(fleet),
                *([] if pooled is None else pooled.remarks),
                *calibration_remarks(
                    selected, self._cause, prior_misfits=contradicted, sensor_lag=sensor_lag
                ),
                *lag_remark(self.lag),
                *([] if approaches is None else approaches.remarks),
                *([] if extent is None else extent.remarks),
                *(() if blamed else bearings),
                *place_remarks(agreement),
                *(() if self._cause or misfits else floor_remark(selected, self.before.robots_own)),
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
