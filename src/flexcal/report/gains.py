"""The report of identified drive gains (`flexcal identify gains`)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexcal.report.notation import NOTHING, percent, significant
from flexcal.report.page import Check, Fact, Page, Section, Status, Table, Verdict, tally, worst
from flexcal.report.render import write_page
from flexcal.report.sections.provenance import provenance_section

_TRUST: dict[Status, tuple[str, str]] = {
    "good": ("Yes", "The gains of all drives are determined"),
    "care": ("With care", "Some gains are uncertain; read which before declaring them"),
    "bad": ("No", "These recordings determine no gain"),
}
_WIDE = 0.05
"""1σ of a factor from which its gain is not known well."""


def write_gains_report(path: str | Path, results: Mapping[str, Any]) -> None:
    """Write the report of a results.json to `path`, atomically; raises `InputError` where it cannot be written."""
    write_page(path, gains_page(results))


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
    checks = (_check_told(len(seen), len(factors)), _check_sharp(seen))
    status = worst(checks)
    answer, headline = _TRUST[status]
    largest = max((abs(item["estimate"] - 1) for item in seen.values()), default=None)
    payloads = sorted(set(results["payloads_kg"]))
    facts = (
        Fact("How far were the declared gains off?", percent(largest), "", "The largest of all drives."),
        Fact(
            "How many are determined?", f"{len(seen)} of {len(factors)}", "", "The others stay as declared."
        ),
        Fact("Can I trust it?", answer, "", f"{tally(checks)}; each is explained below.", status),
    )
    sentence = (
        f"The known mass of the payload is the reference: {len(results['payloads_kg'])} recordings hold "
        f"{' or '.join(f'{mass:g} kg' for mass in payloads)}, and the change of the torques determines the gains."
    )
    return Verdict(status, headline, sentence, facts, (), "", checks)


def _check_told(seen: int, total: int) -> Check:
    question = "Do the recordings determine every gain?"
    if not seen:
        return Check(question, "None: the payload changes no torque by enough.", "bad")
    if seen < total:
        return Check(
            question, f"{seen} of {total}; move the payload so that gravity loads the other joints.", "care"
        )
    return Check(question, f"All {total}.", "good")


def _check_sharp(seen: Mapping[str, Mapping[str, float]]) -> Check:
    question = "Are the gains known well?"
    wide = [name.removesuffix(".drive_gain") for name, item in seen.items() if item["std"] > _WIDE]
    if wide:
        return Check(
            question,
            f"Not of {', '.join(wide)}: worse than {100 * _WIDE:.0f} % (1σ). A heavier payload helps.",
            "care",
        )
    return Check(
        question, f"Each of them to {100 * _WIDE:.0f} % (1σ) or better.", "good" if seen else "unknown"
    )


def _table(results: Mapping[str, Any]) -> Table:
    rows = []
    found = zip(results["parameters"].items(), results["declared_gains"], results["gains"], strict=True)
    for (name, item), declared, gain in found:
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
