"""Stage 1 in the report: stiffness and damping from frequency responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexcal.estimation import Estimate
from flexcal.report.figures import response_fit, sensor_fit, spring_intervals
from flexcal.report.layout import Block, FigureBlock, Section, Selector, Table, Text, percent, significant
from flexcal.report.results import FittedResponse, TwoStageStudy
from flexcal.report.sections.response_levels import levels_block
from flexcal.report.sections.springs import (
    hardening_sentence,
    hysteresis_sentence,
    spring_table,
    unseen_springs,
)
from flexcal.units import DEGREE


def stiffness_section(study: TwoStageStudy) -> Section:
    """Fig. 5, Table 1 and Figs. 7-9."""
    estimate, paper = study.stiffness, study.paper
    published = paper.springs if paper else {}
    source = paper.short if paper else ""
    stiffness, damping = study.springs("stiffness"), study.springs("damping")
    unseen = unseen_springs(estimate, (*stiffness, *damping))
    blocks: list[Block] = [
        spring_table(estimate, stiffness, "stiffness", study.truth, published, source),
        spring_table(estimate, damping, "damping", study.truth, published, source),
    ]
    if hardening := hardening_sentence(estimate):
        blocks.append(Text((), "Hardening", (hardening,)))
    if hysteresis := hysteresis_sentence(estimate):
        blocks.append(Text((), "Hysteresis", (hysteresis,)))
    if unseen:
        blocks.append(Text((), "Not determined by these data", unseen))
    blocks += [
        FigureBlock(
            "figure-springs",
            "Estimates and their 95 % intervals",
            spring_intervals(estimate, stiffness, damping, study.truth, "the truth"),
            "Each dot is an estimate relative to the truth, each bar its 95 % interval. Over many robots 95 % of the bars "
            "should reach zero; those of one fit are correlated, so it may be fewer or more here. Bars beyond the axis are cut.",
            f"Dot plot of {len(stiffness)} stiffnesses and {len(damping)} dampings relative to the truth, with 95 % intervals. "
            "The numbers are in the table.",
        ),
        *response_blocks(study.responses, estimate),
    ]
    return Section(
        "stage1",
        "Stage 1: springs and dampers",
        "Drives and bearings deflect under load, so the arm is not where the motor encoders put it. Small random torques excite the "
        "motors, and the "
        "resonances in the measured accelerations determine the stiffness of each drive and bearing. "
        f"{_experiment(study)}",
        tuple(blocks),
    )


def response_blocks(responses: Sequence[FittedResponse], estimate: Estimate) -> tuple[Block, ...]:
    """Figs. 5 and 7-9, and how well the model fits in every pose."""
    labels = tuple(f"Pose {response.pose + 1}" for response in responses)
    return (
        levels_block(
            "figure-5",
            f"Measured frequency response, {labels[0].lower()}",
            responses[:1],
            labels[:1],
        ),
        FigureBlock(
            "figure-7",
            "Measured frequency responses against the fitted model",
            response_fit(responses, labels),
            "Dots: measured. Lines: model with one set of springs and dampers fitted to all poses. Where an element "
            "nearly vanishes, because the pose hardly couples the two axes, dots scatter and carry little weight.",
            f"Magnitudes of all elements and phases of the diagonal ones in {len(labels)} poses; the table below says how well they fit.",
            (Selector("Pose", "pose", labels),),
        ),
        *sensor_blocks(responses, labels),
        _fit_table(responses, estimate, labels),
    )


def sensor_blocks(responses: Sequence[FittedResponse], labels: tuple[str, ...]) -> tuple[FigureBlock, ...]:
    """Readings of sensors on the arm against the fitted model; none without sensors."""
    names = tuple(dict.fromkeys(name for response in responses for name in response.sensors))
    if not names:
        return ()
    return (
        FigureBlock(
            "figure-sensors",
            "Sensors on the arm against the fitted model",
            sensor_fit(responses, labels),
            "Readings of every sensor on the arm (row) for a torque on each motor (column). Dots: measured. Lines: the model with the "
            "sensor's estimated sensitivity, delay and mounting. Friction scatters the readings together with the motors' accelerations: "
            "dots that lie off the line in both say nothing against the sensor.",
            f"Magnitudes of the readings of {', '.join(names)} in {len(labels)} poses, measured and of the model.",
            (Selector("Pose", "pose", labels),) if len(labels) > 1 else (),
        ),
    )


def _experiment(study: TwoStageStudy) -> str:
    plan = study.plan
    minutes = len(plan.poses) * plan.recordings_per_pose * plan.duration / 60
    low, high = plan.frequencies_hz.min(), plan.frequencies_hz.max()
    return (
        f"Here: {len(plan.poses)} poses, {len(plan.lines)} frequencies from {low:.1f} to {high:.1f} Hz, {plan.realisations} random draws, "
        f"{minutes:.0f} minutes of excitation in all."
    )


def _fit_table(responses: Sequence[FittedResponse], estimate: Estimate, labels: tuple[str, ...]) -> Table:
    rows = []
    for label, response in zip(labels, responses, strict=True):
        off = np.abs(np.diagonal(response.response / response.predicted - 1, axis1=1, axis2=2))
        angles = ", ".join(f"{round(q / DEGREE, 1) + 0.0:.1f}" for q in response.q_mean).replace("-", "−")
        rows.append(
            (
                label,
                f"{angles}°",
                f"{response.payload:g} kg",
                percent(float(np.median(off))),
                significant(float(np.sqrt(np.diagonal(response.misfit).mean())), 3),
                f"{response.degrees_of_freedom:.0f}",
            )
        )
    return Table(
        "table-fit",
        "Goodness of fit by pose",
        (
            "pose",
            "mean joint position",
            "payload",
            "median misfit of the diagonal",
            "the same / measured std",
            "degrees of freedom of the std",
        ),
        tuple(rows),
        f"Over all poses χ² per degree of freedom is {estimate.reduced_chi2:.2f} ({estimate.degrees_of_freedom} degrees of freedom, "
        f"{estimate.status} after {estimate.iterations} iterations). Misfit over std near one means that noise and distortion explain "
        "the residuals.",
        text_columns=(1,),
    )
