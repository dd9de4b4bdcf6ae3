"""The report of identified actuators (`flexcal identify actuators`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.checks import Trust, actuator_checks
from flexcal.report.layout import (
    NOTHING,
    Fact,
    Page,
    Section,
    Status,
    Table,
    Text,
    Verdict,
    percent,
    significant,
)
from flexcal.report.sections import provenance_section

_HEADLINES: dict[Status, str] = {
    "good": "The simulated robot moves like the real one",
    "care": "The simulated robot moves nearly like the real one: read the checks below before relying on it",
    "bad": "The simulated robot does not move like the real one yet",
    "unknown": "Actuators identified; motions outside the fit were not checked",
}


def actuators_page(results: Mapping[str, Any]) -> Page:
    """The page before it becomes HTML."""
    return Page(
        title=f"{results['robot']}: actuators report",
        subtitle=f"Gains, delay, friction and armature from {significant(results['seconds'], 3)} s of commanded and measured positions",
        verdict=_verdict(results),
        sections=(
            Section("errors", "Simulated and measured motion", _LEAD, (_errors(results),)),
            Section("parameters", "Actuators", "", (_parameters(results), Text(tuple(results["remarks"])))),
            provenance_section(results["command"], None, {}, results["provenance"]),
        ),
        document=results,
    )


_LEAD = (
    "A window begins in the measured state, settles, and is then compared for a second. Windows outside the fit are the last of every log. "
    "The command differs from the measured position by lag, delay and sag: the tracking error, which a simulation is to reproduce."
)


def _verdict(results: Mapping[str, Any]) -> Verdict:
    checks = actuator_checks(results)
    trust = Trust(checks)
    shares = {
        joint: item["held_out"]["simulated"] / max(item["held_out"]["commanded"], 1e-300)
        for joint, item in results["errors"].items()
    }
    worst = max(shares, key=lambda joint: shares[joint])
    told = sum(item["identifiable"] for item in results["parameters"].values())
    facts = (
        Fact(
            "How much does the simulation miss?",
            percent(shares[worst]),
            "of the tracking error",
            f"Outside the fit, at {worst}; less at the others.",
        ),
        Fact("How many parameters are determined?", f"{told} of {len(results['parameters'])}", "", ""),
        trust.fact(),
    )
    sentence = (
        f"{results['windows']['fitted']} windows were fitted and {results['windows']['held_out']} others simulated without having been "
        f"fitted, from {len(results['logs'])} {'log' if len(results['logs']) == 1 else 'logs'}."
    )
    return Verdict(trust.status, _HEADLINES[trust.status], sentence, facts, (), "", checks)


def _errors(results: Mapping[str, Any]) -> Table:
    rows = tuple(
        (
            joint,
            significant(item["noise"], 3),
            significant(item["fitted"]["simulated"], 3),
            significant(item["held_out"]["simulated"], 3),
            significant(item["held_out"]["commanded"], 3),
        )
        for joint, item in results["errors"].items()
    )
    return Table(
        "table-errors",
        "Root mean square differences from the measured positions, rad (m where a joint slides)",
        ("joint", "noise", "simulated, fitted", "simulated, outside the fit", "commanded, outside the fit"),
        rows,
    )


def _parameters(results: Mapping[str, Any]) -> Table:
    rows = []
    for name, item in results["parameters"].items():
        known = item["identifiable"]
        interval = (
            f"{significant(item['low'], 4)} to {significant(item['high'], 4)}" if known else "not determined"
        )
        value = significant(item["estimate"], 4) if known else NOTHING
        rows.append((name.replace(".actuator.", ": "), item["unit"], value, interval))
    return Table(
        "table-parameters",
        f"All {len(rows)} parameters",
        ("parameter", "unit", "estimate", "95 % interval"),
        tuple(rows),
        text_columns=(1,),
    )
