"""Accuracy map of the calibrated robot over the working volume."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.accuracy import PredictedAccuracy, error_sources, predicted_accuracy, random_poses_in
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
from flexcal.data.tables import write_table
from flexcal.design.scene import CollisionChecker
from flexcal.errors import InputError, naming
from flexcal.files.formats import provenance
from flexcal.jobs.accuracy.registration_refit import proposed_refit, refit_remarks
from flexcal.jobs.accuracy.verification import verification_poses
from flexcal.jobs.calibration import already_fitted, outside_ranges
from flexcal.jobs.experiments import box_corners, working_file, working_volume
from flexcal.jobs.inputs import (
    CalibratedRobot,
    calibrated_robot,
    is_station_identified,
    require_distinct_files,
    unmeasured_targets_remark,
)
from flexcal.jobs.result_files import RunRecord
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, prediction_checks
from flexcal.report.layout import write_page
from flexcal.report.pages import MapStudy, map_page
from flexcal.units import MILLIMETRE

_WORST = 5
_APART = 0.1
"""Of the extent of all points: worst places are at least so far from each other."""
_SOURCE_POSES = 200
"""Poses at which the sources of the error are averaged."""


@dataclass(frozen=True, eq=False)
class AccuracyMap:
    """The map as it is to be believed, its worst rows, where its errors come from, and what verification poses say.

    `scale` is what they say of the map, `before` of the uncalibrated robot; `unmeasured` what there is to say of a point that the
    calibration did not measure. `box` (2, 3) m, None for given poses or anywhere; `sources` over all poses, `worst_sources` at each of the
    `worst` rows. `record` says what this comes from. `sample` says which of very many verification points were taken.
    """

    reach: Propagation
    map: PredictedAccuracy
    box: np.ndarray | None
    worst: np.ndarray
    sources: dict[str, float]
    worst_sources: dict[str, np.ndarray]
    scale: ErrorScale | None
    before: UncalibratedErrors | None
    unmeasured: tuple[str, ...]
    fitted: tuple[str, ...]
    outside: str
    record: RunRecord
    sample: StratifiedSample | None = None

    @property
    def remarks(self) -> tuple[str, ...]:
        """One sentence each."""
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
        return Trust(prediction_checks(self.scale, self.fitted))

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        predicted, scale = self.map, self.scale
        return {
            "poses": len(predicted.q),
            "target": self.reach.target,
            "station": self.reach.station,
            "payload_kg": self.reach.payload,
            "box_m": self.box,
            "before": None if self.before is None else self.before.document(),
            "predicted": {"mean": _spread(predicted.mean), "p95": _spread(predicted.p95)},
            "sources": self.sources,
            "worst": [
                {
                    "position_m": predicted.position[k],
                    "q": predicted.q[k],
                    "mean_mm": predicted.mean[k] / MILLIMETRE,
                    "p95_mm": predicted.p95[k] / MILLIMETRE,
                    "sources": {kind: float(shares[row]) for kind, shares in self.worst_sources.items()},
                }
                for row, k in enumerate(self.worst)
            ],
            "verification": None
            if scale is None
            else {
                **scale.document(),
                "applied": error_scale_factor(scale),
                "fitted": list(self.fitted),
            },
            "verdict": self.trust.document(),
            "remarks": list(self.remarks),
            **self.record.document(),
        }


def error_scale_factor(scale: ErrorScale | None) -> float:
    """What the map is multiplied by: the factor where errors are larger than chance allows; never less than one."""
    return scale.factor if scale is not None and scale.low > 1 else 1.0


def map_accuracy(
    robot: Path,
    out: Path,
    *,
    working: str | None = None,
    count: int = 20_000,
    verification: Sequence[Path] = (),
    payload: float | None = None,
    estimates: Path | None = None,
    seed: int = 0,
    command: str = "",
    progress: Progress = silent,
) -> AccuracyMap:
    """Predict the tool's error at `count` random poses in a box, or at the poses or points of a file, and write the map to `out`.

    `working` is a box "x:X,y:Y,z:Z", m, base frame, or a file as `read_working` reads it; None for what robot.yaml declares, else anywhere.
    `out` is a page (.html), or a table (.csv, .parquet) with the page beside it. `payload` in kg, None for the declared one. Raises
    `FlexcalError` where there is no calibration, files do not fit, or the robot does not reach.
    """
    if out.suffix not in (".html", ".csv", ".parquet"):
        raise InputError("E-RUN-009", f"{out} must end in .html, .csv or .parquet; give another --out.")
    require_distinct_files(verification)
    calibrated = calibrated_robot(robot, estimates, "map")
    model = calibrated.model
    stations = [s for s in model.stations.names if is_station_identified(model, s)]
    reach = propagation(model, station=stations[0] if stations else None, payload=payload)
    scale, before, study, fitted, sample = _verified(calibrated, verification)
    rng = np.random.default_rng([seed, 7])
    box, q = _poses(reach, working, count, seed, rng, progress)
    predicted = predicted_accuracy(reach, q, progress=progress).scaled(error_scale_factor(scale))
    worst = _worst(predicted)
    some = q[rng.permutation(len(q))[:_SOURCE_POSES]]
    shares = {kind: float(values.mean()) for kind, values in error_sources(reach, some).items()}
    place = working_file(working)
    origin = provenance(
        [robot, calibrated.nominal.urdf, *verification, *(() if place is None else (place,))],
        {"seed": seed},
        calibrated.stored,
        tuple(calibrated.blocks),
    )
    sources = error_sources(reach, q[worst])
    result = AccuracyMap(
        reach,
        predicted,
        box,
        worst,
        shares,
        sources,
        scale,
        before,
        unmeasured_targets_remark(calibrated, [reach.target]),
        fitted,
        outside_ranges(calibrated, q),
        RunRecord(origin, command),
        sample,
    )
    page = MapStudy(model, predicted, box, result.document(), scale, study)
    if out != page_beside(out):
        _write_table(out, predicted)
    write_page(page_beside(out), map_page(page))
    return result


def _poses(
    reach: Propagation,
    working: str | None,
    count: int,
    seed: int,
    rng: np.random.Generator,
    progress: Progress,
) -> tuple[np.ndarray | None, np.ndarray]:
    """The box, where there is one, and the poses."""
    if working_file(working) is not None:
        place = working_volume(CollisionChecker(reach.model), working, seed)
        assert place is not None
        return None, place.q
    declared = reach.model.config.working_volume
    box = None
    if working is not None:
        box = box_corners(working)
    elif declared is not None:
        box = np.array([declared.lower, declared.upper])
    return box, random_poses_in(reach, count, rng, box, progress)


def _verified(
    calibrated: CalibratedRobot, files: Sequence[Path]
) -> tuple[
    ErrorScale | None,
    UncalibratedErrors | None,
    PredictionErrors | None,
    tuple[str, ...],
    StratifiedSample | None,
]:
    """How large errors at the poses of the `files` are against their prediction, those before, the verification, what was fitted, and which
    of very many poses were taken."""
    if not files:
        return None, None, None, (), None
    poses = verification_poses(calibrated, files)
    sample = StratifiedSample.of(poses)
    poses = poses if sample is None else poses.subset(sample.rows)
    verification, covariance = prediction_errors_with_covariance(calibrated.model, poses)
    if (moved := proposed_refit(calibrated.model, poses, verification)) is not None:
        (said,) = refit_remarks(verification, poses, None, moved)
        named = " and ".join(str(file) for file in files)
        raise InputError(
            "E-RUN-010", f"{named} cannot verify the map: {said}; give points measured as the calibration's."
        )
    before = uncalibrated_model(calibrated.nominal, poses).errors(poses)
    with naming(files[0]):
        scale = error_scale(verification, covariance)
    return scale, before, verification, already_fitted(calibrated, files, poses), sample


def _worst(predicted: PredictedAccuracy) -> np.ndarray:
    """Rows of the worst places that are apart from each other, the worst first."""
    least = _APART * float(np.linalg.norm(np.ptp(predicted.position, axis=0)))
    chosen: list[int] = []
    for k in np.argsort(-predicted.p95, kind="stable"):
        if all(np.linalg.norm(predicted.position[k] - predicted.position[c]) >= least for c in chosen):
            chosen.append(int(k))
        if len(chosen) == _WORST:
            break
    return np.array(chosen)


def _write_table(out: Path, predicted: PredictedAccuracy) -> None:
    columns = {name: predicted.position[:, i] for i, name in enumerate("xyz")}
    columns |= {f"q{i + 1}": predicted.q[:, i] for i in range(predicted.q.shape[1])}
    errors = {"mean_mm": predicted.mean / MILLIMETRE, "p95_mm": predicted.p95 / MILLIMETRE}
    write_table(out, columns | errors)


def _spread(values: np.ndarray) -> dict[str, float]:
    """Median, P90 and maximum over the poses, mm."""
    median, most, worst = (float(v) / MILLIMETRE for v in np.quantile(values, [0.5, 0.9, 1.0]))
    return {"median_mm": median, "p90_mm": most, "worst_mm": worst}
