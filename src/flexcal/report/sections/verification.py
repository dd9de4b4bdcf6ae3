"""Verification in the report: accuracy on poses outside the fit."""

from __future__ import annotations

from flexcal.calibration.error_model import ErrorStatistics
from flexcal.calibration.verification import CALIBRATED, RIGID
from flexcal.report.figures import ErrorSeries, error_distribution, predicted_quantiles, verification_errors
from flexcal.report.layout import (
    ELASTIC,
    NOMINAL,
    Block,
    FigureBlock,
    Section,
    Table,
    Text,
    millimetres,
    ratio,
    statistics_cells,
)
from flexcal.report.layout import RIGID as RIGID_COLOUR
from flexcal.report.results import TwoStageStudy
from flexcal.report.sections.measured_words import POINTS


def verification_section(study: TwoStageStudy) -> Section:
    """Fig. 13, the distribution of errors, predicted against observed ones, and the floor."""
    elastic, fresh, paper = study.verification, study.fresh, study.paper
    before, rigid = fresh.before, fresh.statistics(RIGID)
    assert before is not None and fresh.delivered is not None
    series = [
        ErrorSeries("rigid calibration", RIGID_COLOUR, fresh.errors[RIGID]),
        ErrorSeries("elastic calibration", ELASTIC, elastic.errors),
    ]
    everything = [ErrorSeries("before, the robot's own", NOMINAL, fresh.delivered), *series]
    published = {}
    if paper is not None and paper.elastic is not None:
        published |= {"paper, 90 %": (paper.elastic.p90, 0.9), "paper, worst": (paper.elastic.max, 1.0)}
    if paper is not None and paper.rigid is not None:
        published["paper, rigid model, worst"] = (paper.rigid.max, 1.0)
    unclear = int(elastic.ambiguous.sum())
    blocks: list[Block] = [
        accuracy_table(study),
        FigureBlock(
            "figure-13",
            f"Error at {elastic.all.poses} poses outside the fit",
            verification_errors(fresh.poses, series, elastic, paper.elastic if paper else None),
            "Distance from the measured point, on a logarithmic scale. Orange: the best fit of a rigid arm. Blue: with elasticity. "
            + (
                f"Ringed: {unclear} poses where gravity hardly loads a joint with backlash, so its flank is uncertain."
                if unclear
                else "At every pose the flank of the backlash is certain."
            ),
            f"Errors of the elastic calibration reach {millimetres(elastic.all.max)} mm, those of the rigid one "
            f"{millimetres(rigid.max)} mm.",
        ),
        FigureBlock(
            "figure-distribution",
            "Cumulative distribution of the errors",
            error_distribution(everything, published),
            "P90 is where a curve crosses 90 %. Curves farther left are better.",
            f"Cumulative distributions; P90 is {millimetres(elastic.all.p90)} mm with elasticity, "
            f"{millimetres(rigid.p90)} mm without, and {millimetres(before.p90)} mm before.",
        ),
        FigureBlock(
            "figure-predicted",
            "Observed against predicted errors",
            predicted_quantiles(elastic),
            "Parameters, instrument, robot and model error predict how large errors should be. Points on the dashed line: the "
            "prediction was right. Above it: errors are larger than predicted. Below: smaller. Errors are correlated between poses, so "
            "all points may lie on one side by chance.",
            "Sorted observed errors against the quantiles predicted from the covariance of the parameters.",
        ),
        Text(_floor_words(study), "What limits the accuracy"),
        Text(_rigid_words(study), "Comparison with a rigid model"),
    ]
    return Section(
        "verification",
        "Verification on fresh poses",
        f"{elastic.all.poses} random poses anywhere in the working volume, none of them used before. Errors are distances between where "
        "each model says the tool is and where the tracker reads it.",
        tuple(blocks),
    )


def accuracy_table(study: TwoStageStudy) -> Table:
    """Mean, 90 % and worst error of every model on the verification poses."""

    def row(label: str, s: ErrorStatistics, reference: str = "tracker") -> tuple[str, ...]:
        return (label, str(s.poses), *statistics_cells(s), reference)

    fresh = study.fresh
    rows = [
        row(label, fresh.statistics(model)) for model, label in POINTS.before.items() if model in fresh.errors
    ]
    rows += [row(f"rigid calibration, {fit.poses} poses, rank {fit.rank}", fit.errors) for fit in study.rigid]
    elastic = study.verification
    strong = len(rows)
    rows.append(row(f"elastic calibration, {len(study.points.poses)} poses", elastic.all))
    if elastic.ambiguous.any():
        rows.append(row("… where the backlash flank is certain", elastic.unambiguous))
    rows.append(row("… against the noise-free truth", study.exact.statistics(CALIBRATED), "truth"))
    if study.floor is not None:
        rows.append(row("floor: all parameters known exactly", study.floor, "truth"))
    return Table(
        "table-accuracy",
        "Accuracy on fresh poses",
        ("model", "poses", "mean / mm", "P90 / mm", "max / mm", "against"),
        tuple(rows),
        text_columns=(5,),
        strong=(strong,),
    )


def _floor_words(study: TwoStageStudy) -> tuple[str, ...]:
    elastic, floor = study.exact.statistics(CALIBRATED), study.floor
    std = study.verification.parameter_rms
    if floor is None:
        return (
            f"Uncertainty of the parameters alone predicts errors of {millimetres(float((std**2).mean() ** 0.5))} mm (root mean square); "
            f"the calibrated robot is {millimetres(elastic.mean)} mm off on average, measurement noise left out.",
        )
    return (
        f"With every parameter known exactly, {millimetres(floor.p90)} mm would remain (P90), "
        f"{millimetres(floor.mean)} mm on average: encoder resolution, friction that stops the motor short of its target, and other "
        f"errors that no calibration can remove. The calibrated robot reaches {millimetres(elastic.p90)} and {millimetres(elastic.mean)} "
        f"mm.",
        f"Uncertainty of the parameters alone predicts errors of {millimetres(float((std**2).mean() ** 0.5))} mm (root mean square). "
        "More poses, or a better tracker, would reduce that part, but not the floor.",
    )


def _rigid_words(study: TwoStageStudy) -> tuple[str, ...]:
    rigid, elastic = study.fresh.statistics(RIGID), study.verification.all
    first, last = study.rigid[0], study.rigid[-1]
    more = (
        f" With {last.poses} poses instead of {first.poses} the worst becomes {millimetres(last.errors.max)} mm: more measurements do "
        f"not remove the cause."
        if last is not first
        else ""
    )
    return (
        "A rigid model compensates deflection by lengths and angles, which holds only near the poses of the fit: "
        f"the best rigid fit leaves errors up to {millimetres(rigid.max)} mm, {ratio(rigid.max, elastic.max)} the worst error of the "
        f"elastic one.{more} It had its own poses, its own rank and backlash, so the comparison is fair.",
    )
