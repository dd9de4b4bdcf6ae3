"""The report of identified drive gains (`flexcal identify gains`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexcal.report.checks import Trust, gain_checks
from flexcal.report.layout import (
    NOTHING,
    Fact,
    Page,
    Section,
    Status,
    Table,
    Verdict,
    percent,
    significant,
)
from flexcal.report.sections import provenance_section

_HEADLINES: dict[Status, str] = {
    "good": "Drive gains identified, and the numbers can be trusted",
    "care": "Drive gains identified, with reservations: read the checks below before declaring them",
    "bad": "These recordings determine no drive gain",
    "unknown": "Drive gains identified; whether they can be trusted cannot be judged",
}


def gains_page(results: Mapping[str, Any]) -> Page:
    """The page before it becomes HTML."""
    return Page(
        title=f"{results['robot']}: drive gains report",
        subtitle=f"Gains of {len(results['gains'])} drives from recordings with and without a payload",
        verdict=_verdict(results),
        sections=(
            Section("gains", "Gains", "", (_table(results),)),
            provenance_section(results["command"], None, {}, results["provenance"]),
        ),
        document=results,
    )


def _verdict(results: Mapping[str, Any]) -> Verdict:
    factors = results["parameters"]
    seen = {name: item for name, item in factors.items() if item["identifiable"]}
    trust = Trust(gain_checks(factors, results["halves"]))
    largest = max((abs(item["estimate"] - 1) for item in seen.values()), default=None)
    payloads = sorted(set(results["payloads_kg"]))
    facts = (
        Fact("How far were the declared gains off?", percent(largest), "", "The largest of all drives."),
        Fact(
            "How many are determined?", f"{len(seen)} of {len(factors)}", "", "The others stay as declared."
        ),
        trust.fact(),
    )
    sentence = (
        f"The known mass of the payload is the reference: {len(results['payloads_kg'])} recordings hold "
        f"{' or '.join(f'{mass:g} kg' for mass in payloads)}, and the change of the torques determines the gains. "
        "An error of the declared mass changes all gains by the same factor; no check below detects it."
    )
    return Verdict(trust.status, _HEADLINES[trust.status], sentence, facts, (), "", trust.checks)


def _table(results: Mapping[str, Any]) -> Table:
    rows = []
    gains = zip(results["parameters"].items(), results["declared_gains"], results["gains"], strict=True)
    for (name, item), declared, gain in gains:
        known = item["identifiable"]
        rows.append(
            (
                name.removesuffix(".drive_gain"),
                significant(declared, 5),
                significant(item["estimate"], 4) if known else NOTHING,
                f"{significant(item['low'], 4)} to {significant(item['high'], 4)}"
                if known
                else "not determined",
                significant(gain, 5),
            )
        )
    return Table(
        "table-gains",
        "Gains of all drives",
        ("joint", "declared gain", "factor", "95 % interval of the factor", "gain to declare"),
        tuple(rows),
        "Declare the last column under signals: tau: gain: in robot.yaml.",
    )
