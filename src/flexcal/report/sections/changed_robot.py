"""Change of a robot between two calibrations."""

from __future__ import annotations

from flexcal.calibration.comparison import GeometryChange
from flexcal.report.figures import tool_displacement
from flexcal.report.layout import Block as PageBlock
from flexcal.report.layout import FigureBlock, Section, Table, Text, millimetres
from flexcal.report.results import Comparison, amount, chance_in_words, explanation_in_words

_SHOWN = 12
"""Number of parameters in the table, the most significant first."""


def change_section(comparison: Comparison) -> Section:
    """Whether the robot changed, which parameters, and how far the tool moved; or why that is not known."""
    change = comparison.change
    if change is None:
        return Section("change", "Change of the robot", comparison.no_change_why, ())
    first, second = comparison.first.name, comparison.second.name
    lead = (
        f"From {first} to {second}: {comparison.verdict}. The two are compared by positions of the tool, in the {change.combinations} "
        f"combinations of parameters that both determine: χ² = {change.statistic:.1f}. Neither where the instrument stands nor which "
        "parameters a fit drops or holds is a change. What moves the whole robot on its base cannot be told from another place of the "
        "instrument."
    )
    if comparison.shared:
        lead += f" Both runs used {', '.join(comparison.shared)}, so they are no independent test."
    blocks: list[PageBlock] = []
    if change.explanations:
        blocks.append(
            Table(
                "table-explanations",
                "Fewest changes that explain the difference",
                ("what changed", "or, not to be told from it", "chance"),
                tuple(
                    (
                        explanation_in_words(item).partition(" (or ")[0],
                        ", ".join(item.alternatives) or "–",
                        chance_in_words(item.probability),
                    )
                    for item in change.explanations
                ),
                text_columns=(1,),
            )
        )
    return Section("change", "Change of the robot", lead, (*blocks, *_parameters(change), *_moved(change)))


def _parameters(change: GeometryChange) -> list[PageBlock]:
    if not change.shifts:
        return []
    rows = tuple(
        (
            item.name,
            ", ".join(item.absorbed) or "–",
            amount(item.change, item.std, item.unit),
            chance_in_words(item.probability),
            chance_in_words(item.adjusted),
        )
        for item in change.shifts[:_SHOWN]
    )
    return [
        Text(
            (
                "Every parameter is estimated beside all others, in one choice of parameters for both calibrations. A parameter stands for "
                "itself and those beside it, which have the same effect in this choice. The last column is adjusted for the number of "
                f"parameters (Holm 1979): {len(change.shifts)}.",
            ),
            "Parameters",
        ),
        Table(
            "table-change",
            "Changes of the parameters, the most significant first",
            ("parameter", "with", "change ± std", "chance", "adjusted"),
            rows,
            text_columns=(1,),
        ),
    ]


def _moved(change: GeometryChange) -> list[PageBlock]:
    moved, size = change.statistics, change.distance
    order = size.argsort()[::-1][:5]
    rows = tuple(
        (
            str(change.target[k]),
            ", ".join(f"{value:.3f}".replace("-", "−") for value in change.points[k]),
            millimetres(float(size[k])),
            millimetres(float(change.std[k])),
        )
        for k in order
    )
    return [
        Text(
            (
                f"At {len(size)} random poses within the joint ranges of both calibrations the tool moved by "
                f"{millimetres(moved.mean)} mm on average, {millimetres(moved.p90)} mm (P90) and {millimetres(moved.max)} mm at most, "
                "after the best-fit motion of the whole robot was taken out. Chance alone makes "
                f"{millimetres(float((change.std**2).mean() ** 0.5))} mm (root mean square).",
            ),
            "How far the tool moved where",
        ),
        FigureBlock(
            "figure-moved",
            "Displacement of the tool",
            tool_displacement(change),
            "Colour: how far the tool moved. Arrows: where to, exaggerated, the longest the same in every figure.",
            f"Points in the base frame; the tool moved by {millimetres(moved.p90)} mm (P90) and {millimetres(moved.max)} mm at most.",
        ),
        Table(
            "table-moved",
            "Where it moved farthest",
            ("point", "x, y, z / m in the base frame", "moved / mm", "std / mm"),
            rows,
            text_columns=(1,),
        ),
    ]
