"""The report of an axis' response to any excitation (`flexcal identify response FILE`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.report.checks import Trust, excitation_checks
from flexcal.report.figures import bode
from flexcal.report.layout import (
    NOTHING,
    Block,
    Fact,
    FigureBlock,
    Page,
    Section,
    Status,
    Table,
    Text,
    Verdict,
    percent,
    sentences,
    significant,
    to_half_width,
)
from flexcal.report.sections import provenance_section

_HEADLINES: dict[Status, str] = {
    "good": "Response measured, and it repeats",
    "care": "Response measured, with reservations: read the checks below",
    "bad": "Do not use this response yet",
    "unknown": "Response measured; whether it repeats cannot be judged",
}


@dataclass(frozen=True, eq=False)
class ExcitationStudy:
    """The document of results.json, and the arrays of response.npz."""

    results: Mapping[str, Any]
    arrays: Mapping[str, np.ndarray]


def excitation_page(study: ExcitationStudy) -> Page:
    """The page before it becomes HTML."""
    results = study.results
    files = results["excitation"]["files"]
    name = files[0] if len(files) == 1 else f"{files[0]} and {len(files) - 1} more"
    blocks: list[Block] = [_resonance_table(results)]
    if results["masses"]["count"]:
        blocks.append(_masses_table(results["masses"]))
    else:
        blocks.append(Text((f"No masses were fitted: {results['masses']['reason']}.",), "Masses and springs"))
    return Page(
        title=f"{name}: frequency response report",
        subtitle=", ".join(f"{e['output']} to {e['input']}" for e in results["elements"][:4]),
        verdict=_verdict(results),
        sections=(
            Section("resonances", "Resonances, masses and springs", "", tuple(blocks)),
            Section(
                "response",
                "Frequency response",
                "",
                (
                    *(_figure(study, number) for number in range(len(results["elements"]))),
                    _element_table(results),
                ),
            ),
            Section("records", "How the records were read", "", (Text(sentences(results["remarks"])),)),
            provenance_section(results["command"], None, {}, results["provenance"]),
        ),
        document=results,
    )


def _verdict(results: Mapping[str, Any]) -> Verdict:
    trust = Trust(excitation_checks(results))
    resonances, of = results["resonances"], results["excitation"]
    known = [item["frequency_hz"] for item in resonances if item["frequency_hz"]["identifiable"]]
    if known:
        first = known[0]
        half = (first["high"] - first["low"]) / 2
        lowest = Fact(
            "Where is the first resonance?",
            to_half_width(first["estimate"], half),
            "Hz",
            f"95 % interval {to_half_width(first['low'], half)} to {to_half_width(first['high'], half)} Hz; "
            f"{len(resonances)} in the band.",
        )
    else:
        lowest = Fact("Where is the first resonance?", NOTHING, "", "None was found in the excited band.")
    worst = min(results["elements"], key=lambda item: item["coherence"])
    facts = (
        lowest,
        Fact(
            "Does the input explain the output?",
            f"{worst['coherence']:.4f}",
            "",
            f"Coherence at the median line; 1σ of the response is {percent(worst['relative_std'])}.",
        ),
        trust.fact(),
    )
    period = (
        f"repeats itself every {of['period_s']:.6g} s"
        if of["period_s"] is not None
        else "does not repeat itself"
    )
    sentence = (
        f"{of['records']} {'record' if of['records'] == 1 else 'records'} at {of['rate_hz']:.6g} Hz, {of['seconds']:.4g} s in all; the "
        f"excitation {period} and determines the response from {of['low_hz']:.4g} to {of['high_hz']:.4g} Hz."
    )
    return Verdict(trust.status, _HEADLINES[trust.status], sentence, facts, (), "", trust.checks)


def _figure(study: ExcitationStudy, number: int) -> FigureBlock:
    results, arrays = study.results, study.arrays
    element = results["elements"][number]
    inputs = arrays["response"].shape[2]
    y, u = divmod(number, inputs)
    fits = {"modal model": arrays["modal"][:, y, u]}
    if number == 0 and arrays["masses"].size:
        fits[f"{results['masses']['count']} masses"] = arrays["masses"]
    magnitude = np.abs(arrays["response"][:, y, u])
    return FigureBlock(
        f"figure-bode-{number + 1}",
        f"{element['output']} to {element['input']}",
        bode(
            arrays["frequencies_hz"],
            arrays["response"][:, y, u],
            arrays["std"][:, y, u],
            arrays["coherence"][:, y],
            fits,
            element["unit"],
        ),
        "Acceleration for the input, corrected for the hold of a sample. Peaks are resonances, valleys antiresonances; where the thin line "
        "comes near the measured one, the response is not known. Lines closer than "
        f"{significant(results['excitation']['correlated_hz'], 2)} Hz share data, so their errors are correlated.",
        f"Magnitude from {magnitude.min():.3g} to {magnitude.max():.3g} {element['unit']}, phase and coherence against frequency.",
    )


def _resonance_table(results: Mapping[str, Any]) -> Table:
    rows = [("resonance", *_cells(item)) for item in results["resonances"]]
    several = len(results["elements"]) > 1
    for element in results["elements"]:
        of = f" of {element['output']} to {element['input']}" if several else ""
        rows += [(f"antiresonance{of}", *_cells(item)) for item in element["antiresonances"]]
        rows += [
            (f"peak of the magnitude{of}", *_pair(item["frequency_hz"]), NOTHING, NOTHING)
            for item in element["peaks"]
        ]
    if not rows:
        rows = [("none in the band", NOTHING, NOTHING, NOTHING, NOTHING)]
    return Table(
        "table-resonances",
        "Natural frequencies and damping ratios",
        ("", "Hz", "95 % interval", "damping ratio", "95 % interval"),
        tuple(rows),
        "Poles and zeros of the modal model, fitted to the spectra of all records by maximum likelihood; the undamped natural "
        "frequency is given. Peaks are maxima of the magnitude, as read off the figure. A zero whose damping is negative or "
        "not determined is a valley all the same.",
    )


def _cells(item: Mapping[str, Any]) -> tuple[str, ...]:
    return *_pair(item["frequency_hz"]), *_pair(item["damping"])


def _pair(value: Mapping[str, Any]) -> tuple[str, str]:
    if not value["identifiable"]:
        return significant(value["estimate"], 4), "not determined"
    half = (value["high"] - value["low"]) / 2
    low, high = (to_half_width(value[key], half) for key in ("low", "high"))
    return to_half_width(value["estimate"], half), f"{low} to {high}"


def _masses_table(masses: Mapping[str, Any]) -> Table:
    count = masses["count"]
    rows = tuple(
        (name.replace("_", " "), *_pair(item), item["unit"]) for name, item in masses["parameters"].items()
    )
    tried = ", ".join(f"{one['masses']}: {significant(one['criterion'], 5)}" for one in masses["candidates"])
    return Table(
        "table-masses",
        f"Axis of {count} {'mass' if count == 1 else 'masses'}",
        ("parameter", "estimate", "95 % interval", "unit"),
        rows,
        f"Mass 1 is where the input acts, the last one is free. The fit misses the response by {percent(masses['misfit'])} (rms). Bayesian "
        f"information criterion by number of masses, the smallest is best: {tried}. Viscous friction acts on mass 1; Coulomb friction "
        "is seen as viscous friction and added inertia that depend on the amplitude.",
        text_columns=(3,),
    )


def _element_table(results: Mapping[str, Any]) -> Table:
    rows = tuple(
        (
            f"{item['output']} to {item['input']}",
            item["unit"],
            f"{item['coherence']:.4f}",
            f"{item['lowest_coherence']:.3f} at {significant(item['lowest_coherence_hz'], 3)} Hz",
            percent(item["relative_std"]),
        )
        for item in results["elements"]
    )
    return Table(
        "table-elements",
        "Coherence and uncertainty",
        ("element", "unit", "coherence", "lowest", "1σ"),
        rows,
        "Coherence and relative standard deviation at the median line.",
        text_columns=(1,),
    )
