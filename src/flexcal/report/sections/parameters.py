"""The table of estimated geometric parameters."""

from __future__ import annotations

from collections.abc import Mapping

from flexcal.estimation import Estimate
from flexcal.report.figures import parameter_bars, shown_parameters
from flexcal.report.layout import FigureBlock, Table, interval_words, scaled, significant


def parameter_figures(estimate: Estimate, names: tuple[str, ...]) -> tuple[FigureBlock, ...]:
    """The named parameters as bars with intervals, compliances and waves of transmission errors, named or not, in figures of their own.

    Nothing where none can be drawn.
    """
    waves = shown_parameters(
        estimate, [name for name in estimate.parameters.names if ".transmission_" in name]
    )
    shown = [name for name in shown_parameters(estimate, names) if name not in waves]
    yielding = [name for name in shown if estimate.parameters[name].unit == "rad/(N m)"]
    rigid = [name for name in shown if name not in yielding]
    blocks = []
    for part, identity, words, axis, unit in (
        (
            rigid,
            "parameters",
            "Lengths and angles",
            "estimate in units of tolerance",
            "In units of manufacturing tolerance, 0.3 mm and 0.5 mrad; dotted lines are one such unit.",
        ),
        (
            yielding,
            "compliances",
            "Compliances under gravity",
            "compliance / (µrad/(N m))",
            "Turn of a joint per torque; 10 µrad/(N m) is a stiffness of 100 kN m/rad.",
        ),
        (
            waves,
            "transmission",
            "Transmission errors",
            "amplitude of a sine or cosine / (0.5 mrad)",
            "Waves in the joint position, shrunk towards zero as far as the data say little of them; those of which "
            "they say nothing are left out. Effective values: they take up a part of higher orders and compliances that the model lacks.",
        ),
    ):
        if part:
            blocks.append(
                FigureBlock(
                    f"figure-{identity}",
                    f"{words} with their 95 % intervals",
                    parameter_bars(estimate, part, axis),
                    f"{unit} A parameter whose interval holds zero is not significant by itself.",
                    f"Horizontal bars of {len(part)} parameters with intervals.",
                )
            )
    return tuple(blocks)


def parameter_table(
    estimate: Estimate,
    names: tuple[str, ...],
    truth: Mapping[str, float] | None,
    *,
    folded: bool = True,
    remark: str = "",
) -> Table:
    """Estimate, 95 % interval and, where known, the regrouped truth of the named parameters; `remark` ends the note below."""
    should = estimate.regrouped(truth) if truth is not None else None
    rows = []
    for name in names:
        factor, unit = scaled(estimate.parameters[name].unit)
        interval, value = estimate.interval(name), estimate.values[name]
        cells: list[str | None]
        if interval is None:
            cells = ["not determined by these data", None]
        else:
            words = interval_words(estimate, name, lambda v, factor=factor: significant(factor * v, 3))
            cells = [significant(factor * value, 3), words]
        if should is not None:
            inside = interval is not None and interval[0] <= should[name] <= interval[1]
            cells += [significant(factor * should[name], 3), "yes" if inside else "no"]
        rows.append((name, unit, *cells))
    columns = ("parameter", "unit", "estimate", "95 % interval")
    if should is not None:
        columns += ("truth, regrouped", "in interval")
    note = (
        "A kept parameter estimates a combination: the truth beside it has what the dropped parameters really are added in the same way."
        if should is not None
        else "A kept parameter estimates a combination: itself and what it absorbed of the dropped ones."
    )
    return Table(
        "table-parameters",
        f"All {len(rows)} estimated geometric parameters",
        columns,
        tuple(rows),
        f"{note} {remark}".rstrip(),
        text_columns=(1,),
        folded=folded,
    )


def coverage(estimate: Estimate, names: tuple[str, ...], truth: Mapping[str, float]) -> tuple[int, int]:
    """Number of 95 % intervals that contain the (regrouped) truth, and of all."""
    should = estimate.regrouped(truth)
    seen = [(estimate.interval(name), should[name]) for name in names if name in truth]
    known = [(interval, value) for interval, value in seen if interval is not None]
    return sum(low <= value <= high for (low, high), value in known), len(known)
