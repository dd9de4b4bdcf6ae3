"""Spread of parameters over robots of one model, and robots that differ from the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexcal.report.layout import Block, Section, Table, Text, listed, p_value, scaled, significant

_DYNAMICS = "dynamics"
_LISTED = 3
"""Largest number of parameters in a base parameter that are named."""
_OF_BASE = (
    "Torques depend on links and rotors only through combinations of their masses, first moments and inertias: the base parameters. A "
    "value is that of the whole combination, and none of the named parameter alone."
)


def parameter_spreads_section(document: Mapping[str, Any]) -> Section:
    """Spreads and outlying robots, from the document of the verb."""
    spreads = document["parameters"]
    lead = (
        "Latest estimates of robots of one model. The spread is the standard deviation between robots, without the outlying ones and with "
        "the uncertainty of the measurements removed (random effects, Paule and Mandel); 0 means that the measurements explain all "
        "differences. Parameters of instrument and tool, those tied to them, and those that a prior holds are left out. If all robots of a "
        f"model are of one normal distribution, any is named in {100 * document['level']:.0f} % of models at most."
    )
    if not spreads:
        return Section(
            "parameters",
            "Robots of one model",
            lead,
            (Text(("Three robots of one model with a common parameter are needed.",)),),
        )
    outlying = [(spread, item) for spread in spreads for item in spread["outliers"]]
    blocks: list[Block] = []
    if outlying:
        blocks.append(
            Table(
                "table-outlying",
                "Robots that differ from the others",
                (
                    "robot",
                    "model",
                    "parameter",
                    "value ± std",
                    "the others, mean ± spread",
                    "unit",
                    "p, corrected",
                ),
                tuple(_outlier_row(spread, item) for spread, item in outlying),
                text_columns=(1, 2, 5),
            )
        )
    else:
        blocks.append(Text(("No robot differs significantly from the others of its model.",)))
    base = [spread for spread in spreads if spread["kind"] == _DYNAMICS]
    others = [spread for spread in spreads if spread["kind"] != _DYNAMICS]
    if others:
        note = "A parameter that absorbed others, which the measurements do not tell apart, is a combination with these."
        blocks.append(_spread_table("table-spread", "Spread over the robots of a model", others, note))
    if base:
        words = "Spread of base parameters and friction over the robots of a model"
        blocks.append(_spread_table("table-spread-dynamics", words, base, _OF_BASE, folded=True))
    return Section("parameters", "Robots of one model", lead, tuple(blocks))


def _spread_table(
    id: str, caption: str, spreads: Sequence[Mapping[str, Any]], note: str, *, folded: bool = False
) -> Table:
    columns = (
        "parameter",
        "model",
        "robots",
        "mean ± std",
        "spread",
        "95 % interval",
        "measurement's std",
        "unit",
    )
    rows = tuple(_spread_row(spread) for spread in spreads)
    return Table(id, caption, columns, rows, note, text_columns=(1, 7), folded=folded)


def _named(spread: Mapping[str, Any]) -> str:
    """Name of a parameter, of a base parameter with those that are in it."""
    absorbed = spread["absorbs"]
    if spread["kind"] != _DYNAMICS or not absorbed:
        return spread["name"]
    return f"base parameter {spread['name']}, with {listed(absorbed, _LISTED)}"


def _outlier_row(spread: Mapping[str, Any], item: Mapping[str, Any]) -> tuple[str, ...]:
    factor, unit = scaled(spread["unit"])
    value, std, mean, width = (
        significant(factor * number, 3)
        for number in (item["value"], item["std"], spread["mean"], spread["spread"])
    )
    return (
        item["robot"],
        spread["model"],
        _named(spread),
        f"{value} ± {std}",
        f"{mean} ± {width}",
        unit,
        p_value(item["adjusted_probability"]),
    )


def _spread_row(spread: Mapping[str, Any]) -> tuple[str, ...]:
    factor, unit = scaled(spread["unit"])
    mean, mean_std, width, low, high, std = (
        significant(factor * spread[key], 3)
        for key in ("mean", "mean_std", "spread", "spread_low", "spread_high", "measurement_std")
    )
    return (
        _named(spread),
        spread["model"],
        str(spread["robots"]),
        f"{mean} ± {mean_std}",
        width,
        "below the measurements'" if spread["spread_high"] == 0 else f"{low} to {high}",
        std,
        unit,
    )
