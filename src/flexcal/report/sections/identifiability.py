"""Identifiable geometric parameters, and the combinations that absorb the others."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.estimation import Dropped
from flexcal.report.figures import singular_values
from flexcal.report.layout import Block, FigureBlock, Table, Text
from flexcal.report.results import IdentifiableParameters, PublishedValues

_MOST = 4

_NOTHING = 1e-9
"""Amounts (SI) below this are rounding errors of a column that is zero."""


def identifiability_blocks(
    identifiable: IdentifiableParameters, paper: PublishedValues | None
) -> tuple[Block, ...]:
    """The gap, the dropped parameters and the weakest directions that were kept."""
    dropped = identifiable.parameters - identifiable.rank
    words = (
        f"Of {identifiable.parameters} geometric parameters, the measurements determine {identifiable.rank} combinations. The other "
        f"{dropped} would move the tool exactly as some of the kept ones do: a longer first link and a higher base, for example, are not "
        "separately identifiable. They keep their nominal values and are absorbed by the kept ones, which does not affect predictions."
    )
    paragraphs = [words]
    if paper is not None and paper.rank is not None and paper.rank != identifiable.rank:
        paragraphs.append(
            f"The paper keeps {paper.rank} of {paper.parameters}. Exact derivatives give {identifiable.rank}; derivatives by one-sided "
            "differences blur the gap below, which the figure shows to be wide, and can make a dependent parameter look independent."
        )
    blocks: list[Block] = [
        Text(tuple(paragraphs), "Identifiability"),
        FigureBlock(
            "figure-rank",
            "Singular values of the identification Jacobian",
            singular_values(
                identifiable.singular_values, identifiable.diagonal, identifiable.rank, identifiable.gap
            ),
            "Each mark is one direction in the space of parameters, by how far it moves the measured points, relative to the strongest. "
            "Blue directions are determined; grey ones are numerically zero. The wider the gap between them, the less the rank depends "
            "on a threshold.",
            f"Singular values and the diagonal of R of {identifiable.parameters} parameters; {identifiable.rank} are kept, {dropped} are "
            f"smaller by {identifiable.gap:.0f} decades.",
        ),
    ]
    if dropped:
        blocks.append(dropped_table(identifiable.dropped))
    blocks.append(_weak_table(identifiable))
    return tuple(blocks)


def dropped_table(dropped: Sequence[Dropped]) -> Table:
    """Every dropped parameter with what absorbed it."""
    rows = []
    for item in dropped:
        absorbed = [(name, c) for name, c in item.absorbed_by if abs(c) > _NOTHING]
        terms = [_amount(c) + name for name, c in absorbed[:_MOST]]
        more = len(absorbed) - len(terms)
        if more > 0:
            terms.append(f"and {more} more")
        rows.append(
            (item.name, "; ".join(terms) if terms else "nothing: the measurements do not depend on it")
        )
    return Table(
        "table-dropped",
        f"The {len(rows)} dropped parameters, and what absorbed each",
        ("dropped parameter", "absorbed by (amount per unit of the dropped one, SI)"),
        tuple(rows),
        text_columns=(1,),
    )


def _amount(coefficient: float) -> str:
    text = f"{coefficient:.3g}".replace("-", "−")
    return "" if text == "1" else "−" if text == "−1" else f"{text} × "


def _weak_table(identifiable: IdentifiableParameters) -> Table:
    return Table(
        "table-weak",
        "Least determined combinations of the kept parameters",
        ("combination", "strength, relative to the strongest"),
        tuple((name, f"{value:.1e}") for name, value in identifiable.weak),
        "These have the widest intervals; more or better spread poses strengthen them.",
    )
