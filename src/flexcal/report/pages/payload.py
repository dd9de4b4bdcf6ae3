"""The report of an identified payload (`flexcal identify payload`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.estimation import Estimate
from flexcal.report.checks import Trust, payload_checks
from flexcal.report.layout import (
    NOTHING,
    Fact,
    Page,
    Section,
    Status,
    Table,
    Text,
    Verdict,
    interval_words,
    scaled,
    to_half_width,
)
from flexcal.report.sections import provenance_section, recording_labels, signals_table, torque_blocks

_HEADLINES: dict[Status, str] = {
    "good": "Identified, and it can be relied on",
    "care": "Identified, with reservations: read the checks below before relying on it",
    "bad": "Do not rely on this payload yet",
    "unknown": "Identified; there is nothing independent to compare it with",
}
_COM = tuple(f"payload.com_{axis}" for axis in "xyz")


@dataclass(frozen=True, eq=False)
class PayloadStudy:
    """An identified payload, as the folder has it.

    `results` is the document of results.json, `estimate` the block of estimates.yaml; `predictions` are one a recording, first those with
    the payload.
    """

    results: Mapping[str, Any]
    estimate: Estimate
    predictions: Sequence[TorquePrediction]


def payload_page(study: PayloadStudy) -> Page:
    """The page before it becomes HTML."""
    results = study.results
    return Page(
        title=f"{results['robot']}: payload report",
        subtitle=f"Mass, centre of mass and inertia of the payload, in the frame {results['frame']}",
        verdict=_verdict(study),
        sections=(
            Section(
                "payload",
                "Payload",
                f"Everything is in the frame {results['frame']}, the inertia about the centre of mass. It rests on torques in N m: where "
                "these are currents times gains, errors of the gains are errors of the mass.",
                (_table(study), Text((results["declaration"],), "The same as a line of robot.yaml")),
            ),
            Section(
                "torques",
                "Torques: predicted against measured",
                "Predicted with payload, friction and the robot's own parameters as this fit has them.",
                (
                    *torque_blocks(results["error_percent"], "", _logs(study), results.get("torque_units")),
                    signals_table(results["signals"]),
                ),
            ),
            provenance_section(results["command"], None, {}, results["provenance"]),
        ),
        document=results,
    )


def _logs(study: PayloadStudy) -> dict[str, TorquePrediction]:
    recordings = study.results["recordings"]
    kinds = ["with payload"] * len(recordings["loaded"]) + ["without"] * len(recordings["free"])
    labelled_logs = zip(recording_labels(study.predictions), kinds, study.predictions, strict=True)
    return {f"{label}, {kind}": log for label, kind, log in labelled_logs}


def _verdict(study: PayloadStudy) -> Verdict:
    results, checks = study.results, payload_checks(study.results)
    trust = Trust(checks)
    estimate = study.estimate
    mass, com = _rounded(estimate, "payload.mass"), ", ".join(_rounded(estimate, name) for name in _COM)
    declared = results["declared"]
    was = "robot.yaml declares none." if declared is None else f"robot.yaml: {declared['payload.mass']:g} kg."
    halves = (_half_width(estimate, name) for name in _COM)
    widths = ", ".join(NOTHING if half is None else f"± {to_half_width(half, half)}" for half in halves)
    facts = (
        Fact("How heavy is it?", mass, "kg", f"95 %: {_value(estimate, 'payload.mass')[1]} kg. {was}"),
        Fact(
            "Where is its centre of mass (x, y, z / mm)?",
            com,
            "",
            f"In the frame {results['frame']}; 95 %: {widths} mm.",
        ),
        trust.fact(),
    )
    loaded, free = (len(results["recordings"][key]) for key in ("loaded", "free"))
    without = f" and {free} without" if free else ""
    sentence = (
        f"Mass and centre of mass come from the torques of {loaded} {'recording' if loaded == 1 else 'recordings'} with the payload"
        f"{without}; deflection under load is computed with them."
    )
    return Verdict(trust.status, _HEADLINES[trust.status], sentence, facts, (), "", checks)


def _table(study: PayloadStudy) -> Table:
    declared, rows = study.results["declared"], []
    for item in study.estimate.parameters:
        factor, unit = scaled(item.unit)
        known = study.estimate.interval(item.name) is not None
        stays = "as robot.yaml declares it" if declared is not None else "at zero"
        cells = _value(study.estimate, item.name) if known else (f"not determined, stays {stays}", None)
        was = () if declared is None else (f"{factor * declared[item.name]:.5g}".replace("-", "−"),)
        rows.append((item.name.removeprefix("payload."), unit, *cells, *was))
    columns = ("parameter", "unit", "estimate", "95 % interval")
    return Table(
        "table-payload",
        "Payload parameters",
        columns if declared is None else (*columns, "robot.yaml"),
        tuple(rows),
        text_columns=(1,),
    )


def _half_width(estimate: Estimate, name: str) -> float | None:
    """Half width of the 95 % interval, in the printed unit."""
    interval = estimate.interval(name)
    return (
        None
        if interval is None
        else scaled(estimate.parameters[name].unit)[0] * (interval[1] - interval[0]) / 2
    )


def _rounded(estimate: Estimate, name: str) -> str:
    """Estimate to the first significant digit of its interval's half width; a dash where it is not told."""
    half = _half_width(estimate, name)
    factor = scaled(estimate.parameters[name].unit)[0]
    return NOTHING if half is None else to_half_width(factor * estimate.values[name], half, 1)


def _value(estimate: Estimate, name: str) -> tuple[str, str]:
    """Estimate and 95 % interval in the unit that is printed, a dash for both where they are not told."""
    interval, half = estimate.interval(name), _half_width(estimate, name)
    if interval is None or half is None:
        return NOTHING, NOTHING
    factor = scaled(estimate.parameters[name].unit)[0]
    words = interval_words(estimate, name, lambda v: to_half_width(factor * v, half))
    return to_half_width(factor * estimate.values[name], half), words
