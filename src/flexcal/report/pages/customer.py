"""The customer's version of a calibration or verification: two sheets of A4 with before, after and uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.calibration.verification import CALIBRATED, MeasuredPoints
from flexcal.files.transaction import write_text
from flexcal.report.checks import ANSWERS, Trust
from flexcal.report.layout import (
    LIGHT,
    document_millimetres,
    millimetres,
    sentences,
    significant,
    statistics_cells,
    templates,
)
from flexcal.report.pages.certificate import error_strip
from flexcal.report.results import MeasurementDetails
from flexcal.report.sections import MeasuredWords

_MARKS = {"good": "✓", "care": "!", "bad": "✗", "unknown": "?"}
_FILES = 8
"""Largest number of files listed on the sheet."""
_REMARKS = 4


@dataclass(frozen=True, eq=False)
class CustomerStudy:
    """Results of `fit_geometry` or `prediction_errors`, its points, the verdict, and the files it was made from (name: SHA-256)."""

    results: Mapping[str, Any]
    points: MeasuredPoints
    trust: Trust
    files: Mapping[str, str]
    particulars: MeasurementDetails

    @property
    def verified(self) -> bool:
        """Whether the points are those of a verification rather than of the fit."""
        return "rms_mm" in self.results


def write_customer_report(path: Path, study: CustomerStudy) -> None:
    """Write the two sheets of `study` to `path`, atomically; raises `InputError` where it cannot be written."""
    write_text(path, customer_html(study))


def customer_html(study: CustomerStudy) -> str:
    """The whole document; nothing in it is loaded from elsewhere, and it needs no scripts."""
    folder = files("flexcal.report") / "templates"
    after, remarks = study.points.statistics(CALIBRATED), sentences(study.results["remarks"])
    return (
        templates()
        .get_template("customer.html.j2")
        .render(
            results=study.results,
            particulars=study.particulars.rows(),
            conditions=_conditions(study),
            noun="verification points, outside the fit"
            if study.verified
            else f"{MeasuredWords.of(study.points.poses).rows} of the fit",
            before=study.points.before and millimetres(study.points.before.p90),
            after=millimetres(after.p90),
            rows=accuracy_rows(study.points),
            strip=_strip(study.points),
            answer=ANSWERS[study.trust.status],
            status=study.trust.status,
            sentence=study.trust.sentence.partition(" — because ")[2],
            checks=[(_MARKS[c.status], c.question, c.answer) for c in study.trust.checks],
            uncertainty=uncertainty_rows(study.results),
            remarks=remarks[-_REMARKS:],
            more_remarks=max(0, len(remarks) - _REMARKS),
            files=list(study.files.items())[:_FILES],
            more_files=max(0, len(study.files) - _FILES),
            colours=LIGHT,
            style=(folder / "certificate.css").read_text("utf-8"),
        )
    )


def accuracy_rows(points: MeasuredPoints) -> list[tuple[str, str, str, str]]:
    """Label, mean, P90 and maximum in mm, before and after."""
    labels = {**MeasuredWords.of(points.poses).before, CALIBRATED: "after calibration"}
    return [
        (label, *statistics_cells(points.statistics(model)))
        for model, label in labels.items()
        if model in points.errors
    ]


def uncertainty_rows(results: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Parts of the error budget in mm, as far as the results have them."""
    budget, rms, fit = results.get("variances") or {}, results.get("rms_mm") or {}, results.get("fit") or {}
    rows = [
        ("instrument, 1σ per coordinate", budget.get("instrument_mm")),
        ("instrument as stated, 1σ per coordinate", budget.get("stated_mm")),
        ("repeatability of the robot, 1σ per coordinate", budget.get("robot_mm")),
        ("model, 1σ per coordinate", budget.get("model_mm")),
        ("calibrated parameters, predicted, rms", rms.get("parameters")),
        ("parameters and instrument, predicted, rms", rms.get("expected")),
        ("measured, rms", rms.get("measured")),
        ("measurement noise used in the fit, 1σ per coordinate", fit.get("sigma_mm")),
    ]
    return [(label, f"{document_millimetres(value)} mm") for label, value in rows if value is not None]


def _conditions(study: CustomerStudy) -> list[tuple[str, str]]:
    poses = study.points.poses
    held = poses.in_socket.all()
    rows = [
        (
            "poses with the ball in a socket" if held else "measured points",
            f"{len(poses)} ({', '.join(poses.targets)})",
        )
    ]
    if len(poses.stations) > 1:
        rows.append(("places of the fixture" if held else "instrument stations", str(len(poses.stations))))
    if poses.payload is not None:
        masses = sorted(set(np.unique(poses.payload.round(3)).tolist()))
        rows.append(("payload", ", ".join(f"{significant(mass, 4)} kg" for mass in masses)))
    if poses.temperature is not None:
        rows.append(("temperature", f"{poses.temperature.min():.1f} to {poses.temperature.max():.1f}"))
    return rows


def _strip(points: MeasuredPoints) -> dict[str, Any] | None:
    return None if points.delivered is None else error_strip(points.delivered, points.calibrated)
