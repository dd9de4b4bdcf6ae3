"""Remarks on a calibration fitted to a sample of the points."""

from __future__ import annotations

from typing import Any

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.fit import StratifiedSample
from flexcal.units import MILLIMETRE


def subsample_document(
    sample: StratifiedSample | None, everywhere: ErrorStatistics | None
) -> dict[str, Any] | None:
    """Block `sample` of results.json; null if every point was taken."""
    if sample is None or everywhere is None:
        return None
    return {"points": sample.total, "taken": len(sample.rows), "all": everywhere.in_millimetres()}


def calibration_subsample_remark(
    sample: StratifiedSample | None, everywhere: ErrorStatistics | None
) -> list[str]:
    """Remark of a calibration on its sample of points."""
    if sample is None or everywhere is None:
        return []
    return [
        f"of {sample.total} points {len(sample.rows)} were fitted, drawn evenly over positions and stations; errors of the calibrated "
        f"robot at all points: {_words(everywhere)}"
    ]


def verification_subsample_remark(
    sample: StratifiedSample | None, everywhere: ErrorStatistics | None
) -> list[str]:
    """Remark of a verification on the calibration's sample of points."""
    if sample is None or everywhere is None:
        return []
    return [
        f"the errors are those of all {sample.total} points; figures, checks and intervals are of {len(sample.rows)} of them, drawn evenly "
        "over positions and stations"
    ]


def _words(errors: ErrorStatistics) -> str:
    return f"mean {errors.mean / MILLIMETRE:.3f}, p90 {errors.p90 / MILLIMETRE:.3f}, max {errors.max / MILLIMETRE:.3f} mm"
