"""Tables of results for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table

from flexcal.units import decimals

NOTHING = "–"
"""Where there is no number."""


def error_table(title: str, rows: Mapping[str, Mapping[str, Any]], scatter: float | None = None) -> Table:
    """Error statistics, one row per set: poses, mean, 90th percentile and maximum, mm; `rows` are blocks of results.json by label.

    `scatter`, mm, of the points decides how many decimals mean something.
    """
    table = Table(title=title, title_justify="left")
    table.add_column("")
    for heading in ("poses", "mean mm", "p90 mm", "max mm"):
        table.add_column(heading, justify="right")
    for label, block in rows.items():
        numbers = [_millimetres(block[key], decimals(scatter)) for key in ("mean_mm", "p90_mm", "max_mm")]
        table.add_row(label, str(block["poses"]), *numbers)
    return table


def orientation_table(block: Mapping[str, Any]) -> Table:
    """Angles between measured and predicted axes, degrees; `block` is `orientation` of results.json."""
    placed = " (axes of the target fitted to them)"
    table = Table(title="angle to the measured orientations", title_justify="left")
    table.add_column("")
    for heading in ("poses", "mean °", "p90 °", "max °"):
        table.add_column(heading, justify="right")
    for label, key in (("before, best-fit registered", "before"), ("calibrated", "calibrated")):
        row = block[key]
        if row is not None:
            numbers = [f"{row[name]:.4f}" for name in ("mean_deg", "p90_deg", "max_deg")]
            label += placed if key == "calibrated" and row["placed"] else ""
            table.add_row(label, str(row["poses"]), *numbers)
    return table


def inclination_table(block: Mapping[str, Any]) -> Table:
    """Errors of every inclinometer before and after, mrad; `block` is `inclination` of results.json."""
    table = Table(title="difference from the inclinometers' readings", title_justify="left")
    table.add_column("")
    for heading in ("poses", "rms mrad", "p90 mrad", "max mrad"):
        table.add_column(heading, justify="right")
    for name, entry in block.items():
        for label, row in (("before, mounting and base fitted", entry["before"]), ("calibrated", entry)):
            numbers = [f"{row[key]:.3g}" for key in ("rms_mrad", "p90_mrad", "max_mrad")]
            table.add_row(f"{name}: {label}", str(row["poses"]), *numbers)
    return table


def uncalibrated_rows(document: Mapping[str, Any], *, held: bool = False) -> dict[str, Mapping[str, Any]]:
    """The blocks `before` of a document as rows of `error_table`, dashes where one is not known; `held`: of a ball in sockets."""
    labels = {
        "declared": "before, as declared",
        "registered": "before, best-fit registered",
        "own": "before, the robot's own: point found too",
    }
    if held:
        labels = {
            "registered": "before, sockets placed by best fit",
            "own": "before, the robot's own: ball found too",
        }
    unknown = {"poses": NOTHING, "mean_mm": None, "p90_mm": None, "max_mm": None}
    return {label: document["before"][key] or unknown for key, label in labels.items()}


def map_table(document: Mapping[str, Any]) -> Table:
    """Error of the uncalibrated tool, predicted mean and 95 % of the calibrated one: median, P90 and maximum over the poses, mm."""
    table = Table(title="predicted error of the tool", title_justify="left")
    table.add_column("")
    for heading in ("median mm", "P90 mm", "max mm"):
        table.add_column(heading, justify="right")
    for label, key in (("uncalibrated", "uncalibrated"), ("mean", "mean"), ("95 % within", "p95")):
        numbers = document["predicted"][key]
        if numbers is not None:
            table.add_row(label, *(_millimetres(value) for value in numbers.values()))
    return table


def repeatability_table(document: Mapping[str, Any]) -> Table:
    """One row a measure of ISO 9283: mean and largest over the poses, mm."""
    visits = document["visits"]
    table = Table(
        title=f"{document['poses']} poses, {visits['total']} visits, {visits['fewest']} at least (ISO 9283)",
        title_justify="left",
    )
    table.add_column("")
    for heading in ("mean mm", "max mm"):
        table.add_column(heading, justify="right")
    labels = {
        "rp_mm": "repeatability RP",
        "ap_nominal_mm": "accuracy AP, before (the robot's own)",
        "ap_calibrated_mm": "accuracy AP, calibrated",
        "vap_mm": "variation of AP by direction, vAP",
    }
    drifting = {
        "drp_mm": "drift of repeatability, dRP",
        "dap_nominal_mm": "drift of accuracy, before, dAP",
        "dap_calibrated_mm": "drift of accuracy, calibrated, dAP",
        "way_mm": "displacement of the barycentre",
    }
    for block, named in ((document, labels), (document["drift"] or {}, drifting)):
        for key, label in named.items():
            if block.get(key) is not None:
                table.add_row(label, *(_millimetres(value) for value in block[key].values()))
    return table


def predicted_table(std: Mapping[str, float]) -> Table:
    """One row a spring: predicted standard deviations of stiffness and damping, relative, by parameter name."""
    table = Table(title="predicted standard deviation", title_justify="left")
    table.add_column("")
    for heading in ("stiffness %", "damping %"):
        table.add_column(heading, justify="right")
    for name in std:
        spring, _, kind = name.rpartition(".")
        if kind == "stiffness":
            table.add_row(spring, f"{100 * std[name]:.2f}", f"{100 * std[f'{spring}.damping']:.1f}")
    return table


def dropped_table(identifiability: Mapping[str, Any], most: int = 4) -> Table:
    """Parameters that are not identifiable, and the `most` largest coefficients of the parameters that absorb each."""
    title = f"identifiability: {identifiability['rank']} of {identifiability['parameters']} parameters"
    if identifiability["gap_decades"] is not None and identifiability["dropped"]:
        title += (
            f" ({identifiability['gap_decades']:.0f} decades between the last kept and the first dropped)"
        )
    table = Table(title=title, title_justify="left")
    table.add_column("not identifiable")
    table.add_column("absorbed by")
    for entry in identifiability["dropped"]:
        kept = entry["absorbed_by"]
        parts = [f"{k['coefficient']:+.3g} {k['name']}" for k in kept[:most]]
        more = f" and {len(kept) - most} more" if len(kept) > most else ""
        table.add_row(
            entry["name"],
            ", ".join(parts) + more if kept else "nothing: the measurements do not depend on it",
        )
    return table


def weak_table(directions: Sequence[Mapping[str, Any]]) -> Table:
    """The least determined combinations of parameters."""
    table = Table(title="least determined combinations", title_justify="left")
    table.add_column("relative size", justify="right")
    table.add_column("combination, in units of 0.3 mm and 0.5 mrad")
    for entry in directions:
        table.add_row(f"{entry['relative_singular_value']:.1e}", entry["direction"])
    return table


def quantity_table(
    title: str, quantities: Mapping[str, Mapping[str, Any]], units: Mapping[str, str]
) -> Table:
    """One row a parameter: estimate, standard deviation, 95 % interval."""
    table = Table(title=title, title_justify="left")
    table.add_column("parameter")
    for heading in ("estimate", "std", "95 % from", "to"):
        table.add_column(heading, justify="right")
    table.add_column("unit")
    for name, values in quantities.items():
        numbers = ["not", "identifiable", ""]
        if values["identifiable"]:
            numbers = [f"{values[key]:.5g}" for key in ("std", "low", "high")]
            numbers[0] = numbers[0] if values["bound"] is None else "at a bound"
        table.add_row(name, f"{values['estimate']:.5g}", *numbers, units.get(name, ""))
    return table


def comparison_table(kind: str, joints: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> Table:
    """One row a spring: estimate, 95 % interval and truth of its stiffness or damping; `joints` as in results.json."""
    table = Table(title=f"{kind} ({'N m/rad' if kind == 'stiffness' else 'N m s/rad'})", title_justify="left")
    table.add_column("spring")
    for heading in ("estimate", "95 % from", "to", "truth", "error"):
        table.add_column(heading, justify="right")
    for joint, springs in joints.items():
        for spring, values in springs.items():
            numbers = ["not", "identifiable"]
            if values["identifiable"]:
                numbers = [f"{values[key]:.4g}" for key in ("low", "high")]
            truth = values["truth"]
            compared = ["–", "–"]
            if truth is not None:
                compared = [f"{truth:.4g}", f"{100 * (values['estimate'] / truth - 1):+.1f} %"]
            table.add_row(f"{joint}.{spring}", f"{values['estimate']:.4g}", *numbers, *compared)
    return table


def response_table(responses: Sequence[Mapping[str, Any]]) -> Table:
    """One row a frequency response: band, and median relative standard deviation of its diagonal."""
    table = Table(title="frequency responses", title_justify="left")
    for heading in ("pose", "lines", "Hz", "relative std", "noise", "degrees of freedom"):
        table.add_column(heading, justify="right")
    table.add_column("file")
    for r in responses:
        band = f"{r['lowest_hz']:g} – {r['highest_hz']:g}"
        std, noise = f"{100 * r['relative_std']:.2f} %", f"{100 * r['relative_noise_std']:.2f} %"
        table.add_row(
            str(r["pose"]),
            str(r["lines"]),
            band,
            std,
            noise,
            f"{r['degrees_of_freedom']:.0f}",
            str(r["file"]),
        )
    return table


def _millimetres(value: float | None, digits: int = 3) -> str:
    return NOTHING if value is None else f"{value:.{digits}f}"


def base_parameter_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """One row a base parameter, written out: estimate, standard deviation, that in per cent of the estimate, and what is essential."""
    table = Table(title="base parameters", title_justify="left")
    table.add_column("parameter")
    for heading in ("estimate", "std", "%", "essential"):
        table.add_column(heading, justify="right")
    table.add_column("unit")
    for row in rows:
        std = "not identifiable" if row["std"] is None else f"{row['std']:.3g}"
        percent = "" if row["std_percent"] is None else f"{row['std_percent']:.1f}"
        essential = "" if row["essential"] is None else f"{row['essential']:.5g}"
        table.add_row(row["name"], f"{row['estimate']:.5g}", std, percent, essential, row["unit"])
    return table


def drive_gain_table(factors: Mapping[str, Mapping[str, Any]], declared: Sequence[float]) -> Table:
    """One row per joint: declared drive gain, identified gain and its 95 % interval."""
    table = Table(title="drive gains", title_justify="left")
    table.add_column("joint")
    for heading in ("declared", "identified", "95 % interval"):
        table.add_column(heading, justify="right")
    for (name, factor), gain in zip(factors.items(), declared, strict=True):
        gain_text, interval = "not identifiable", ""
        if factor["identifiable"]:
            ends = sorted((gain * factor["low"], gain * factor["high"]))
            gain_text, interval = f"{gain * factor['estimate']:.5g}", f"{ends[0]:.5g} to {ends[1]:.5g}"
        table.add_row(name.rpartition(".")[0], f"{gain:.5g}", gain_text, interval)
    return table


def friction_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """The best sets of none, one, two … friction terms beyond the classic ones, with their cross-validation errors."""
    best: dict[int, Mapping[str, Any]] = {}
    for row in rows:
        best_of_size = best.setdefault(len(row["terms"]), row)
        if row["cross_validation_percent"] < best_of_size["cross_validation_percent"]:
            best[len(row["terms"])] = row
    table = Table(title="friction terms tried", title_justify="left")
    table.add_column("beyond the classic ones")
    table.add_column("cross-validation, %", justify="right")
    table.add_column("p-value of the last", justify="right")
    for row in best.values():
        p_value = "" if row["p_value"] is None else f"{row['p_value']:.2g}"
        table.add_row(", ".join(row["terms"]) or "none", f"{row['cross_validation_percent']:.2f}", p_value)
    return table


def learned_table(motors: Sequence[Mapping[str, Any]]) -> Table:
    """Relative torque error of each motor in cross-validation, without and with the learned residual."""
    table = Table(title="learned residual torque", title_justify="left")
    table.add_column("motor")
    for heading in ("cross-validation without, %", "with, %"):
        table.add_column(heading, justify="right")
    table.add_column("")
    for row in motors:
        error = row["cross_validation_percent"]
        verdict = "learned" if row["learned"] else "no improvement"
        table.add_row(row["motor"], f"{error['without']:.2f}", f"{error['with']:.2f}", verdict)
    return table


def gain_table(document: Mapping[str, Any]) -> Table:
    """Improvement by stage 0: errors of both stages with CAD inertials alone and with identified inertials."""
    table = Table(title="improvement by stage 0", title_justify="left")
    table.add_column("")
    for heading in ("CAD alone", "with stage 0"):
        table.add_column(heading, justify="right")
    both = (document["cad_alone"], document)
    errors = [_largest_error(run["stage1"]["stiffness"]) for run in both]
    table.add_row("largest stiffness error", *(f"{100 * e:.2f} %" for e in errors))
    for key, label in (("mean_mm", "mean mm"), ("p90_mm", "p90 mm"), ("max_mm", "max mm")):
        values = (run["verification"]["elastic"][key] for run in both)
        table.add_row(f"fresh poses, {label}", *(_millimetres(v) for v in values))
    return table


def _largest_error(joints: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> float:
    return max(abs(q["estimate"] / q["truth"] - 1) for springs in joints.values() for q in springs.values())
