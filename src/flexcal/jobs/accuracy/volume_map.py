"""Accuracy map of the calibrated robot over the working volume."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.accuracy import (
    PredictedAccuracy,
    Registration,
    distance_to_nominal,
    error_sources,
    predicted_accuracy,
    random_poses_in,
)
from flexcal.calibration.fit import StratifiedSample
from flexcal.calibration.measurement import Propagation, propagation
from flexcal.calibration.verification import (
    ErrorScale,
    PredictionErrors,
    UncalibratedErrors,
    error_scale,
    prediction_errors_with_covariance,
    uncalibrated_model,
)
from flexcal.data.plans import page_beside
from flexcal.data.poses import PoseSet
from flexcal.data.tables import streamed_table
from flexcal.design.scene import CollisionChecker
from flexcal.errors import FlexcalError, InputError, naming
from flexcal.files.formats import provenance
from flexcal.jobs.accuracy.error_quantiles import RELATIVE_ERROR
from flexcal.jobs.accuracy.map_blocks import BLOCK, MapBlocks, MapSummary
from flexcal.jobs.accuracy.map_table import MapTable, least_distance, worst_places
from flexcal.jobs.accuracy.registration_refit import proposed_refit, refit_remarks
from flexcal.jobs.accuracy.verification import verification_poses
from flexcal.jobs.calibration import fitted_files, fitted_points, outside_ranges
from flexcal.jobs.experiments import box_corners, working_file, working_volume
from flexcal.jobs.inputs import (
    CalibratedRobot,
    is_station_identified,
    outdated_remarks,
    refused_remark,
    require_distinct_files,
    require_temperature,
    temperature_remarks,
    unmeasured_targets_remark,
)
from flexcal.jobs.pages import PlottedResult
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord
from flexcal.parallel import Workers, open_workers
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, prediction_checks
from flexcal.report.layout import Page
from flexcal.report.pages import MapStudy, map_page
from flexcal.units import MILLIMETRE

_SOURCE_POSES = 200
"""Number of poses over which the sources of the error are averaged."""
_SHARES = (0.5, 0.9, 1.0)
"""Shares of the poses up to the quantiles of the errors."""


@dataclass(frozen=True, eq=False, repr=False)
class AccuracyMap(PlottedResult):
    """Result of `accuracy_map`: predicted error of the tool over the working volume, and its sources.

    Attributes
    ----------
    model : RobotModel
        The calibrated robot.
    reach : Propagation
        Poses of the map, and how parameters act on the tool there.
    predicted : PredictedAccuracy
        Predicted errors: `position` (N, 3), `mean` and `p95` (N,), m; of very many random poses, in blocks, those of the first block.
    uncalibrated : ndarray or None
        Distance (N,), m, of the tool of the uncalibrated robot, best-fit registered, from that of the calibrated one; None for fewer than
        four poses.
    box : ndarray or None
        Working volume, smallest and largest x, y, z (2, 3), m; None for given poses or anywhere.
    worst : PredictedAccuracy
        The places of the largest errors.
    sources : dict of float
        Share (0 to 1) of the error's variance by kind of parameter, over all poses; correlated kinds do not add up to one.
    worst_sources : dict of ndarray
        The same at each of the `worst` rows.
    scale : ErrorScale or None
        What verification poses say of the map.
    before : UncalibratedErrors or None
        Errors of the uncalibrated robot at the verification poses.
    verification : PredictionErrors or None
        Errors of the calibrated robot at the verification poses.
    unmeasured : tuple of str
        Remarks on a point that the calibration did not measure.
    fitted : tuple of str
        Files or points among the verification that the calibration was made from.
    outside : str
        Which verification poses lie outside the joint ranges of the calibration.
    sample : StratifiedSample or None
        Which of very many verification points were taken.
    record : RunRecord
        What the result comes from.
    whole : MapSummary or None
        Quantiles over all poses, where `predicted` has only the first of them.
    refused : str
        Why the verdict on the calibration itself was no; empty where it was not.
    """

    reach: Propagation
    predicted: PredictedAccuracy
    uncalibrated: np.ndarray | None
    box: np.ndarray | None
    worst: PredictedAccuracy
    sources: dict[str, float]
    worst_sources: dict[str, np.ndarray]
    scale: ErrorScale | None
    before: UncalibratedErrors | None
    verification: PredictionErrors | None
    unmeasured: tuple[str, ...]
    fitted: tuple[str, ...]
    outside: str
    sample: StratifiedSample | None = None
    record: RunRecord = NOT_RECORDED
    whole: MapSummary | None = None
    refused: str = ""

    @property
    def poses(self) -> int:
        """Number of poses."""
        return len(self.predicted.q) if self.whole is None else self.whole.poses

    @property
    def headline(self) -> str:
        """Median and largest 95 % bound of the error."""
        bound = self._errors()["p95"]
        assert bound is not None
        return (
            f"95 % bound of the tool's error at {self.poses} poses: median {bound['median_mm']:.3f}, "
            f"largest {bound['worst_mm']:.3f} mm"
        )

    def summary(self) -> str:
        """The bound, the shares of its sources, remarks and verdict."""
        shares = ", ".join(f"{kind} {100 * share:.0f} %" for kind, share in self.sources.items())
        return "\n".join([self.headline, f"sources: {shares}", *self.remarks, self.trust.sentence])

    def _page(self) -> Page:
        study = MapStudy(self.model, self.predicted, self.box, self.document(), self.scale, self.verification)
        return map_page(study)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks, one sentence each."""
        remarks = list(self.unmeasured)
        if self.scale is None:
            remarks.append(
                "no verification: the map is based on the covariance of the calibration alone; give --verification with poses "
                "outside the fit"
            )
        elif not self.scale.noise_known:
            remarks.append(
                "the verification files state no sigma, so the instrument's noise is counted as an error of the robot; 'flexcal "
                "import --sigma' states it"
            )
        if self.sample is not None:
            remarks.append(
                f"of {self.sample.total} verification points {len(self.sample.rows)} test the map, drawn evenly over positions and stations"
            )
        if self.whole is not None:
            remarks.append(
                f"computed in blocks: median and P90 are right to {100 * RELATIVE_ERROR:g} %; figures, sources and the registration of the "
                f"uncalibrated robot are those of the first {len(self.predicted.q)} poses"
            )
        if self.outside:
            remarks.append(self.outside)
        if self.fitted:
            remarks.append(
                f"the calibration was fitted to {' and '.join(self.fitted)}, so this is no verification"
            )
        return tuple(remarks)

    @property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        return Trust(prediction_checks(self.scale, self.fitted, self.refused))

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        worst, scale = self.worst, self.scale
        return {
            "poses": self.poses,
            "target": self.reach.target,
            "station": self.reach.station,
            "payload_kg": self.reach.payload,
            "box_m": self.box,
            "before": None if self.before is None else self.before.document(),
            "predicted": self._errors(),
            "quantile_error_percent": 0.0 if self.whole is None else 100 * RELATIVE_ERROR,
            "sources": self.sources,
            "worst": [
                {
                    "position_m": worst.position[row],
                    "q": worst.q[row],
                    "mean_mm": worst.mean[row] / MILLIMETRE,
                    "p95_mm": worst.p95[row] / MILLIMETRE,
                    "sources": {kind: float(shares[row]) for kind, shares in self.worst_sources.items()},
                }
                for row in range(len(worst.q))
            ],
            "verification": None
            if scale is None
            else {
                **scale.document(),
                "applied": error_scale_factor(scale),
                "fitted": list(self.fitted),
            },
            "refused": self.refused,
            "verdict": self.trust.document(),
            "remarks": list(self.remarks),
            **self.record.document(),
        }

    def _errors(self) -> dict[str, dict[str, float] | None]:
        """Median, P90 and maximum of every error over the poses, mm; None where it is not known."""
        predicted, whole = self.predicted, self.whole
        if whole is None:
            each = {"uncalibrated": self.uncalibrated, "mean": predicted.mean, "p95": predicted.p95}
            return {
                name: None
                if values is None
                else _millimetres(*(float(value) for value in np.quantile(values, _SHARES)))
                for name, values in each.items()
            }
        counts = {"uncalibrated": whole.uncalibrated, "mean": whole.mean, "p95": whole.p95}
        return {
            name: None if values is None else _millimetres(*(values.quantile(share) for share in _SHARES))
            for name, values in counts.items()
        }


def error_scale_factor(scale: ErrorScale | None) -> float:
    """Factor by which the map is scaled if observed errors are larger than predicted beyond chance; at least one."""
    return scale.factor if scale is not None and scale.low > 1 else 1.0


def accuracy_map(
    robot: CalibratedRobot,
    *,
    box: np.ndarray | None = None,
    q: np.ndarray | None = None,
    count: int = 20_000,
    verification: PoseSet | None = None,
    payload: float | None = None,
    temperature: float | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> AccuracyMap:
    """Predict the error of a calibrated robot's tool over its working volume, from the covariance of the calibration.

    Parameters
    ----------
    robot : CalibratedRobot
        `Calibration.robot`, or ``CalibratedRobot.from_yaml(path)``.
    box : ndarray, optional
        Smallest and largest x, y, z (2, 3), m, in the base frame; by default what robot.yaml declares, else anywhere.
    q : ndarray, optional
        Joint positions (N, n), rad or m, to take instead of random ones.
    count : int
        Number of random poses.
    verification : PoseSet, optional
        Points measured outside the fit. Where errors there are larger than predicted, the map is scaled up; never down.
    payload : float, optional
        Mass, kg; by default as declared.
    temperature : float, optional
        Temperature of the arm, °C; by default that at which the calibrated parameters hold.
    seed : int
        Seed of the random poses.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    AccuracyMap
        `predicted.position` (N, 3), `predicted.mean` and `predicted.p95` (N,), m; `sources`, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        Where the robot does not reach the box, and where the verification poses were measured from another place than the calibration's.

    Examples
    --------
    >>> from flexcal import RobotModel, accuracy_map, calibrate, read_poses
    >>> model = RobotModel.from_yaml("examples/ur5_tracker/robot.yaml", estimates=False)
    >>> poses = read_poses("examples/ur5_tracker/grid.csv", model).subset(slice(None, None, 13))
    >>> robot = calibrate(model, poses, terms=["kinematic"]).robot
    >>> map = accuracy_map(robot, count=50)
    >>> map.predicted.p95.shape
    (50,)
    """
    check = None if verification is None else _Check.of(robot, verification)
    return _checked_map(robot, check, box, q, count, payload, temperature, seed, progress)


def _checked_map(
    robot: CalibratedRobot,
    check: _Check | None,
    box: np.ndarray | None,
    q: np.ndarray | None,
    count: int,
    payload: float | None,
    temperature: float | None,
    seed: int,
    progress: Progress,
) -> AccuracyMap:
    """`accuracy_map` after the check by verification poses."""
    require_temperature(temperature)
    # what inclinometers alone leave open is uncertain by the tolerances
    model = robot.model if robot.measured else robot.probable
    # a fixture with sockets is no instrument: what it tells is in the base frame
    instruments = robot.nominal.stations.names
    stations = [s for s in instruments if is_station_identified(model, s)]
    reach = propagation(
        model, station=stations[0] if stations else None, payload=payload, temperature=temperature
    )
    rng = np.random.default_rng([seed, 7])
    if q is None:
        declared = model.config.working_volume
        if box is None and declared is not None:
            box = np.array([declared.lower, declared.upper])
        q = random_poses_in(reach, count, rng, box, progress)
    scale = None if check is None else check.scale
    predicted = predicted_accuracy(reach, q, progress=progress).scaled(error_scale_factor(scale))
    worst = predicted.part(worst_places(predicted))
    some = q[rng.permutation(len(q))[:_SOURCE_POSES]]
    return AccuracyMap(
        model,
        reach,
        predicted,
        distance_to_nominal(model, robot.with_points, q, reach.target, reach.payload, temperature),
        box,
        worst,
        {kind: float(values.mean()) for kind, values in error_sources(reach, some).items()},
        error_sources(reach, worst.q),
        scale,
        None if check is None else check.before,
        None if check is None else check.errors,
        (
            *refused_remark(robot),
            *outdated_remarks(robot),
            *unmeasured_targets_remark(robot, [reach.target]),
            *temperature_remarks(robot, None if temperature is None else np.array([temperature]), "errors"),
        ),
        () if check is None else check.fitted,
        outside_ranges(robot, q),
        None if check is None else check.sample,
        refused=robot.refused,
    )


def map_accuracy(
    robot_file: Path,
    out: Path,
    *,
    working: str | None = None,
    count: int = 20_000,
    verification: Sequence[Path] = (),
    payload: float | None = None,
    temperature: float | None = None,
    estimates: Path | None = None,
    seed: int = 0,
    command: str = "",
    on: str | None = None,
    jobs: int = 1,
    progress: Progress = silent,
) -> AccuracyMap:
    """`accuracy_map` of the robot of a robot.yaml, written to `out`, a page (.html), or a table (.csv, .parquet) with the page beside it.

    Very many random poses go block by block through memory, in `jobs` processes or `on` the Dask cluster of an address: then quantiles of
    the errors are right to 0.1 %, and the page's figures, sources and remarks are of the first block.

    `working` is a box "x:X,y:Y,z:Z", m, base frame, or a file as `read_working` reads it; None for what robot.yaml declares, else anywhere.
    `verification` are files of measured poses. Raises `FlexcalError` where there is no calibration, files do not fit, and as
    `accuracy_map` does.
    """
    if out.suffix not in (".html", ".csv", ".parquet"):
        raise InputError("E-RUN-009", f"{out} must end in .html, .csv or .parquet; give another --out.")
    require_distinct_files(verification)
    robot = CalibratedRobot.from_yaml(robot_file, estimates)
    check = None
    if verification:
        poses = verification_poses(robot, verification)
        with naming(verification[0]):
            check = _Check.of(robot, poses)
    box, q = None, None
    place = working_file(working)
    if place is not None:
        assert working is not None
        q = working_volume(CollisionChecker(robot.model), working, seed).q
    elif working is not None:
        box = box_corners(working)
    with open_workers(on, jobs) as workers:
        accuracy = _checked_map(robot, check, box, q, min(count, BLOCK), payload, temperature, seed, progress)
        if q is None and count > BLOCK:
            accuracy = _of_blocks(accuracy, robot, count, temperature, seed, out, workers, progress)
    origin = provenance(
        [robot_file, robot.nominal.urdf, *verification, *(() if place is None else (place,))],
        {"seed": seed},
        robot.stored,
        tuple(robot.blocks),
    )
    fitted = fitted_files(robot, verification) or accuracy.fitted
    result = replace(accuracy, fitted=fitted, record=RunRecord(origin, command))
    if out != page_beside(out) and result.whole is None:
        MapTable(result.predicted, result.uncalibrated).write(out)
    result.report(page_beside(out))
    return result


def _of_blocks(
    first: AccuracyMap,
    robot: CalibratedRobot,
    count: int,
    temperature: float | None,
    seed: int,
    out: Path,
    workers: Workers,
    progress: Progress,
) -> AccuracyMap:
    """Map of `count` poses of which `first` has a block; its table, if any, is written to `out`."""
    predicted, reach = first.predicted, first.reach
    place = Registration.of(
        first.model, robot.with_points, predicted.q, reach.target, reach.payload, temperature
    )
    apart = least_distance(predicted)
    factor = error_scale_factor(first.scale)
    blocks = MapBlocks(reach, first.box, count, seed, factor, place, apart, BLOCK)
    start = MapSummary.of(predicted, first.uncalibrated, apart)
    if out == page_beside(out):
        whole = blocks.summarised(start, workers, None, progress)
    else:
        with streamed_table(out) as append:
            append(MapTable(predicted, first.uncalibrated).columns)
            whole = blocks.summarised(start, workers, append, progress)
    return replace(first, whole=whole, worst=whole.worst, worst_sources=error_sources(reach, whole.worst.q))


@dataclass(frozen=True, eq=False)
class _Check:
    """Check by verification poses: errors after and before calibration, ratio to the prediction, and refitted quantities."""

    errors: PredictionErrors
    before: UncalibratedErrors
    scale: ErrorScale
    fitted: tuple[str, ...]
    sample: StratifiedSample | None

    @classmethod
    def of(cls, robot: CalibratedRobot, poses: PoseSet) -> _Check:
        sample = StratifiedSample.of(poses)
        poses = poses if sample is None else poses.subset(sample.rows)
        errors, covariance = prediction_errors_with_covariance(robot.model, poses)
        if (moved := proposed_refit(robot.model, poses, errors)) is not None:
            (said,) = refit_remarks(errors, poses, None, moved)
            raise FlexcalError(
                "E-RUN-010",
                f"the verification poses cannot verify the map: {said}; give points measured as the calibration's.",
            )
        before = uncalibrated_model(robot.nominal, poses).errors(poses)
        return cls(errors, before, error_scale(errors, covariance), fitted_points(robot, poses), sample)


def _millimetres(median: float, most: float, worst: float) -> dict[str, float]:
    return {
        "median_mm": median / MILLIMETRE,
        "p90_mm": most / MILLIMETRE,
        "worst_mm": worst / MILLIMETRE,
    }
