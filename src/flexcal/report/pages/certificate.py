"""Accuracy certificate: pose accuracy before and after compensation, on two sheets of A4 (`flexcal certificate`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.files.transaction import write_text
from flexcal.report.checks import verdict_answer
from flexcal.report.layout import LIGHT, NOTHING, document_millimetres, significant, templates
from flexcal.report.results import MeasurementDetails
from flexcal.units import MILLIMETRE

_WIDTH, _ROW = 640.0, 34.0
"""Width of the error strip and height of one row, in its own units."""


@dataclass(frozen=True, eq=False)
class CertificateStudy:
    """`results` as the verb prints them, error vectors (P, 3) m of the targets before and after, and particulars of the measurement."""

    results: Mapping[str, Any]
    before: np.ndarray
    after: np.ndarray
    particulars: MeasurementDetails


def write_certificate(path: Path, study: CertificateStudy) -> None:
    """Write the certificate of `study` to `path`, atomically; raises `InputError` where it cannot be written."""
    write_text(path, certificate_html(study))


def certificate_html(study: CertificateStudy) -> str:
    """The whole document, for A4; nothing in it is loaded from elsewhere, and it needs no scripts."""
    results = study.results
    style = (files("flexcal.report") / "templates" / "certificate.css").read_text("utf-8")
    return (
        templates()
        .get_template("certificate.html.j2")
        .render(
            results=results,
            particulars=study.particulars.rows(),
            rows=accuracy_rows(results),
            parts=limiting_parts(results),
            conditions=_conditions(results),
            judgement=_judgement(results),
            trust=verdict_answer(results["verdict"]),
            strip=error_strip(study.before, study.after),
            colours=LIGHT,
            style=style,
        )
    )


def accuracy_rows(results: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Label, AP mean, 90 % and worst, RP worst, in mm."""
    labels = {
        "before": "before: nominal commands, best-fit registered, point found too",
        "after": "after: compensated commands, in the calibrated frame",
        "after_refitted": "after: compensated commands, best-fit registered, point found too",
    }
    before = {"declared": "before, as declared", "registered": "before, best-fit registered"}
    names = ("mean_mm", "p90_mm", "max_mm")
    rows = []
    for key, label in labels.items():
        block = results[key]
        repeated = NOTHING if block["rp"] is None else document_millimetres(block["rp"]["max_mm"])
        rows.append(
            (
                label,
                *(document_millimetres(block["ap"][name]) for name in names),
                repeated,
            )
        )
    for key, label in before.items():
        block = results["before"][key] or dict.fromkeys(names)
        rows.append((label, *(document_millimetres(block[name]) for name in names), NOTHING))
    return rows


def limiting_parts(results: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Parts of the error budget after compensation, root mean square, mm."""
    labels = {
        "measured": "measured distance to the target",
        "parameters": "uncertainty of the calibration, predicted",
        "instrument": "noise of the instrument, stated",
        "visit_to_visit": "repeatability, instrument included, measured",
    }
    return [(label, document_millimetres(results["rms_mm"].get(key))) for key, label in labels.items()]


def _conditions(results: Mapping[str, Any]) -> list[tuple[str, str]]:
    before, after = results["before"], results["after"]
    temperature = results["temperature"]
    sigma = results["sigma_mm"]
    return [
        ("point", ", ".join(results["points"])),
        ("instrument station", ", ".join(results["stations"])),
        (
            "instrument, 1σ per coordinate",
            "not stated" if sigma is None else f"{document_millimetres(sigma)} mm",
        ),
        ("payload", ", ".join(f"{significant(mass, 4)} kg" for mass in results["payload_kg"])),
        (
            "temperature",
            "not recorded" if temperature is None else f"{temperature[0]:.1f} to {temperature[1]:.1f}",
        ),
        ("targets compared", str(results["targets"])),
        ("measurements", f"{before['measurements']} before, {after['measurements']} after"),
    ]


def _judgement(results: Mapping[str, Any]) -> str:
    prediction = results["prediction"]
    words = {
        "right": "The predicted uncertainty holds.",
        "optimistic": "The predicted uncertainty was too small.",
        "unknown": "The predicted uncertainty cannot be judged: these numbers contain instrument noise of unknown size.",
        "cautious": "The predicted uncertainty was larger than needed.",
    }[prediction["verdict"]]
    return (
        f"{words} After compensation {100 * prediction['inside_95_percent']:.0f} % of the measurements lie within the bound predicted "
        f"for 95 % of them; errors are {prediction['ratio']:.2f} times as large as the calibration predicts (95 % "
        f"interval {prediction['ratio_low']:.2f} to {prediction['ratio_high']:.2f})."
    )


def error_strip(before: np.ndarray, after: np.ndarray) -> dict[str, Any]:
    """Dots of the distances on a logarithmic scale: places of ticks and dots in a drawing 640 wide, with its height.

    Dots at one place of the drawing are drawn once.
    """
    distances = [np.linalg.norm(errors, axis=1) / MILLIMETRE for errors in (before, after)]
    every = np.concatenate(distances)
    low = np.floor(np.log10(max(float(np.quantile(every, 0.01)), 1e-4)))
    high = max(np.ceil(np.log10(max(float(every.max()), 1e-4))), low + 1)

    def place(values: np.ndarray) -> list[float]:
        share = (np.log10(np.maximum(values, 10.0**low)) - low) / (high - low)
        return np.unique((_WIDTH * share).round(1)).tolist()

    powers = np.arange(low, high + 1)
    return {
        "width": _WIDTH,
        "row": _ROW,
        "ticks": list(zip(place(10.0**powers), [f"{10.0**p:g}" for p in powers], strict=True)),
        "rows": [("before", place(distances[0]), "rigid"), ("after", place(distances[1]), "elastic")],
    }
