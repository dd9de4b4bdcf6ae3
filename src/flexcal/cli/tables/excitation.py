"""Tables of the response of an axis to any excitation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from flexcal.report.layout import NOTHING, to_half_width


def element_table(document: Mapping[str, Any]) -> Table:
    """One row an element of the response: coherence, and median relative standard deviation."""
    of = document["excitation"]
    table = Table(
        title=f"frequency response, {of['low_hz']:.4g} – {of['high_hz']:.4g} Hz, {of['lines']} lines, {of['records']} "
        f"{'record' if of['records'] == 1 else 'records'}",
        title_justify="left",
    )
    for heading in ("output", "input", "unit"):
        table.add_column(heading)
    for heading in ("coherence", "lowest", "at Hz", "relative std"):
        table.add_column(heading, justify="right")
    for item in document["elements"]:
        table.add_row(
            *(item[key] for key in ("output", "input", "unit")),
            f"{item['coherence']:.4f}",
            f"{item['lowest_coherence']:.3f}",
            f"{item['lowest_coherence_hz']:.3g}",
            f"{100 * item['relative_std']:.2g} %",
        )
    return table


def resonance_table(document: Mapping[str, Any]) -> Table:
    """Resonances, and antiresonances of every element, with intervals."""
    table = Table(title="natural frequencies and damping ratios, 95 % intervals", title_justify="left")
    table.add_column("")
    for heading in ("Hz", "interval", "damping", "interval"):
        table.add_column(heading, justify="right")
    for item in document["resonances"]:
        table.add_row("resonance", *_cells(item))
    several = len(document["elements"]) > 1
    for element in document["elements"]:
        of = f" of {element['output']} to {element['input']}" if several else ""
        for item in element["antiresonances"]:
            table.add_row(f"antiresonance{of}", *_cells(item))
        for item in element["peaks"]:
            table.add_row(f"peak of the magnitude{of}", *_pair(item["frequency_hz"]), "", "")
    return table


def _cells(item: Mapping[str, Any]) -> tuple[str, ...]:
    return *_pair(item["frequency_hz"]), *_pair(item["damping"])


def _pair(value: Mapping[str, Any]) -> tuple[str, str]:
    if not value["identifiable"]:
        return f"{value['estimate']:.4g}", "not determined"
    half = (value["high"] - value["low"]) / 2
    estimate, low, high = (to_half_width(value[key], half) for key in ("estimate", "low", "high"))
    return estimate, f"{low} – {high}"


def masses_table(masses: Mapping[str, Any]) -> Table:
    """Parameters of the chain of masses."""
    count = masses["count"]
    miss = masses["misfit"]
    text = NOTHING if miss is None else f"{100 * miss:.2g} %"
    table = Table(
        title=f"axis of {count} {'mass' if count == 1 else 'masses'}; misses the response by {text} (rms)",
        title_justify="left",
    )
    table.add_column("parameter")
    for heading in ("estimate", "95 % interval"):
        table.add_column(heading, justify="right")
    table.add_column("unit")
    for name, item in masses["parameters"].items():
        table.add_row(name, *_pair(item), item["unit"])
    return table
