"""Verification in the report: accuracy on poses that the fit never saw."""

from __future__ import annotations

from flexcal.calibration import ErrorStatistics
from flexcal.report.figures.error_distribution import error_distribution
from flexcal.report.figures.predicted_quantiles import predicted_quantiles
from flexcal.report.figures.verification_errors import ErrorSeries, verification_errors
from flexcal.report.notation import millimetres, ratio, statistics_cells
from flexcal.report.page import Block, FigureBlock, Section, Table, Text
from flexcal.report.palette import ELASTIC, NOMINAL, RIGID
from flexcal.report.study import TwoStageStudy


def verification_section(study: TwoStageStudy) -> Section:
    """Fig. 13, the distribution of errors, predicted against observed ones, and the floor."""
    elastic, paper = study.elastic_verification, study.paper
    series = [
        ErrorSeries("rigid calibration", RIGID, study.rigid_verification[0].errors),
        ErrorSeries("elastic calibration", ELASTIC, elastic.errors),
    ]
    everything = [ErrorSeries("as delivered", NOMINAL, study.nominal_verification.errors), *series]
    published = {}
    if paper is not None and paper.elastic is not None:
        published |= {"paper, 90 %": (paper.elastic.p90, 0.9), "paper, worst": (paper.elastic.max, 1.0)}
    if paper is not None and paper.rigid is not None:
        published["paper, rigid model, worst"] = (paper.rigid.max, 1.0)
    extra = (
        "the instrument's noise" if study.truth is None else "the floor" if study.floor else "nothing else"
    )
    unclear = int(elastic.ambiguous.sum())
    blocks: list[Block] = [
        accuracy_table(study),
        FigureBlock(
            "figure-13",
            f"Figure 13: error at {elastic.all.poses} poses that the fit never saw",
            verification_errors(study.verification_poses, series, elastic, paper.elastic if paper else None),
            f"Distance from {study.reference}, on a logarithmic scale. Orange: the best fit of a rigid arm. Blue: with elasticity. "
            + (
                f"Ringed: {unclear} poses where gravity hardly loads a joint with backlash, so its side is not certain."
                if unclear
                else "At every pose the side of the backlash is certain."
            ),
            f"Errors of the elastic calibration reach {millimetres(elastic.all.max)} mm, those of the rigid one "
            f"{millimetres(study.rigid_verification[0].all.max)} mm.",
        ),
        FigureBlock(
            "figure-distribution",
            "What share of poses is better than a given error",
            error_distribution(everything, published),
            "Read across at 90 %: nine of ten poses have an error smaller than where the curve crosses. Curves farther left are better.",
            f"Cumulative distributions; 90 % of poses are within {millimetres(elastic.all.p90)} mm with elasticity, "
            f"{millimetres(study.rigid_verification[0].all.p90)} mm without, and "
            f"{millimetres(study.nominal_verification.all.p90)} mm as delivered.",
        ),
        FigureBlock(
            "figure-predicted",
            "Predicted against observed errors",
            predicted_quantiles(elastic, study.unpredicted_noise),
            f"The covariance of the parameters, with {extra}, predicts how large errors should be. Points on the dashed line: the "
            "prediction was right. Above it: the robot is worse than promised. Below: better. The poses share one set of parameters, so "
            "the whole row of points may lie somewhat to one side by chance.",
            "Sorted observed errors against the quantiles predicted from the covariance of the parameters.",
        ),
        Text(_floor_words(study), "What limits the accuracy"),
        Text(_rigid_words(study), "Why a rigid model is not enough"),
    ]
    return Section(
        "verification",
        "Verification on fresh poses",
        f"{elastic.all.poses} random poses anywhere in the working volume, none of them used before. Errors are distances between where "
        f"each model says the tool is and {study.reference}.",
        tuple(blocks),
    )


def accuracy_table(study: TwoStageStudy) -> Table:
    """Mean, 90 % and worst error of every model on the verification poses."""
    against = "truth" if study.truth is not None else "instrument"

    def row(label: str, s: ErrorStatistics, reference: str = against) -> tuple[str, ...]:
        return (label, str(s.poses), *statistics_cells(s), reference)

    rows = [row("as delivered (nominal)", study.nominal_verification.all)]
    for fit, verification in zip(study.rigid, study.rigid_verification, strict=True):
        label = f"rigid calibration, {len(fit.poses)} poses, rank {fit.identifiability.rank}"
        rows.append(row(label, verification.all))
    elastic = study.elastic_verification
    strong = len(rows)
    rows.append(row(f"elastic calibration, {len(study.calibration.poses)} poses", elastic.all))
    if elastic.ambiguous.any():
        rows.append(row("… where the backlash flank is certain", elastic.unambiguous))
    if study.measured_verification is not None and study.truth is not None:
        rows.append(row("… as the instrument sees it", study.measured_verification.all, "instrument"))
    if study.floor is not None:
        rows.append(row("floor: every parameter known", study.floor))
    return Table(
        "table-accuracy",
        "Accuracy on fresh poses",
        ("model", "poses", "mean / mm", "90 % within / mm", "worst / mm", "against"),
        tuple(rows),
        text_columns=(5,),
        strong=(strong,),
    )


def _floor_words(study: TwoStageStudy) -> tuple[str, ...]:
    elastic = study.elastic_verification.all
    if study.floor is not None:
        words = [
            f"With every parameter known exactly, {millimetres(study.floor.p90)} mm would remain at 90 % of the poses, "
            f"{millimetres(study.floor.mean)} mm on average: encoder steps, friction that holds the motor short of rest, and other things "
            f"that no calibration can take out. The calibrated robot reaches {millimetres(elastic.p90)} and {millimetres(elastic.mean)} mm."
        ]
    else:
        words = [
            "The floor, what would remain with every parameter known exactly, was not computed for this run."
        ]
    std = study.elastic_verification.parameter_rms
    if (std > 0).any():
        words.append(
            f"Uncertainty of the parameters alone predicts errors of {millimetres(float((std**2).mean() ** 0.5))} mm (root mean square). "
            "More poses, or a better tracker, would lower that part; the floor stays."
        )
    return tuple(words)


def _rigid_words(study: TwoStageStudy) -> tuple[str, ...]:
    rigid, elastic = study.rigid_verification[0].all, study.elastic_verification.all
    more = (
        f" With {len(study.rigid[-1].poses)} poses instead of {len(study.rigid[0].poses)} the worst becomes "
        f"{millimetres(study.rigid_verification[-1].all.max)} mm: measuring more does not remove the cause."
        if len(study.rigid) > 1
        else ""
    )
    return (
        "A rigid model has to explain by lengths and angles what gravity bends. It can do so near the poses it was fitted to, and misses "
        f"elsewhere: the best rigid fit leaves up to {millimetres(rigid.max)} mm, {ratio(rigid.max, elastic.max)} the worst error of the "
        f"elastic one.{more} It had its own poses, its own rank and backlash, so the comparison is fair.",
    )
