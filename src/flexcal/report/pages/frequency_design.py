"""The page of a plan of frequency experiments (`flexcal design frequency`): poses, amplitudes, predicted standard deviations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexcal.design.frequency import PlannedResponses
from flexcal.estimation import LOG_STD_LIMIT
from flexcal.model.robot import RobotModel
from flexcal.report.figures import amplitude_spectrum, planned_arm, poses_against_std, predicted_springs
from flexcal.report.layout import (
    Block,
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Table,
    Verdict,
    significant,
    spring_label,
    tally,
    worst,
)
from flexcal.report.sections import provenance_section

LARGE = 0.05
"""Relative standard deviation above which a stiffness is known poorly; above `LOG_STD_LIMIT` it is not identifiable."""


@dataclass(frozen=True, eq=False)
class FrequencyDesignStudy:
    """A robot, what was planned for it, the same with equal amplitudes, and the document of the verb.

    `curve` (3, K): numbers of poses, and the largest standard deviation of a stiffness with as many, chosen and at random; None where the
    poses were given.
    """

    model: RobotModel
    planned: PlannedResponses
    flat: PlannedResponses
    curve: np.ndarray | None
    results: Mapping[str, Any]


def frequency_page(study: FrequencyDesignStudy) -> Page:
    """The page before it becomes HTML."""
    plan, results = study.planned.plan, study.results
    minutes = results["seconds_on_the_robot"] / 60
    return Page(
        title=f"{study.model.name}: plan of the frequency experiments",
        subtitle=f"{len(plan.poses)} poses · {len(plan.lines)} lines from {plan.frequencies_hz[0]:g} to {plan.frequencies_hz[-1]:g} Hz · "
        f"{plan.realisations} realisations · {minutes:.0f} minutes on the robot",
        verdict=_verdict(study),
        sections=[
            _springs(study),
            _poses(study),
            _amplitudes(study),
            provenance_section(results["command"], results["seed"], {}, results["provenance"]),
        ],
        document=results,
    )


def _verdict(study: FrequencyDesignStudy) -> Verdict:
    largest = study.results["largest_stiffness_std"]
    spring, std = spring_label(largest["name"]), largest["std"]
    checks = (_known(spring, std), _explained(study))
    minutes = study.results["seconds_on_the_robot"] / 60
    facts = (
        Fact("How accurate will the stiffnesses be?", significant(100 * std, 2), "%", f"Worst is {spring}."),
        Fact("How long does it take?", f"{minutes:.0f}", "min", f"{study.results['recordings']} recordings."),
        Fact(
            "Will all be determined?",
            "Yes" if std < LOG_STD_LIMIT else "No",
            "",
            tally(checks),
            worst(checks),
        ),
    )
    sentence = (
        f"Predicted from the model, its sensors and its friction: the largest relative standard deviation of a stiffness is "
        f"{significant(100 * std, 2)} %, that of {spring}."
    )
    headline = (
        "Every stiffness is identifiable"
        if std < LOG_STD_LIMIT
        else f"The stiffness of {spring} is not identifiable"
    )
    return Verdict(worst(checks), headline, sentence, facts, (), "", checks)


def _known(spring: str, std: float) -> Check:
    question = "Do these poses determine every stiffness?"
    if std > LOG_STD_LIMIT:
        return Check(
            question,
            f"No: the standard deviation of {spring} is {100 * std:.0f} %, above {100 * LOG_STD_LIMIT:.0f} %. Choose other poses, or a "
            "payload off the axis.",
            "bad",
        )
    return Check(
        question,
        f"Yes, the worst, {spring}, to {significant(100 * std, 2)} %.",
        "care" if std > LARGE else "good",
    )


def _explained(study: FrequencyDesignStudy) -> Check:
    errors = [np.median(r.relative_error(study.planned.plan)) for r in study.planned.responses]
    large = max(errors)
    answer = (
        f"The median relative error of the response is at most {significant(100 * large, 2)} % in every pose."
    )
    return Check(
        "Are the responses larger than noise and friction?", answer, "good" if large < 0.1 else "care"
    )


def _springs(study: FrequencyDesignStudy) -> Section:
    planned, flat = study.results["predicted_std"], study.results["predicted_std_flat"]
    names = [name for name in planned if name.endswith(".stiffness")]
    rows = tuple(
        (
            spring_label(name),
            significant(100 * planned[name], 2),
            significant(100 * flat[name], 2),
            significant(100 * planned[name.replace(".stiffness", ".damping")], 2),
        )
        for name in names
    )
    heads = ("spring", "stiffness / %", "with a flat spectrum / %", "damping / %")
    return Section(
        "springs",
        "Predicted accuracy of the springs",
        "Predicted from sensor noise, friction under the reference motion, and the uncertainty of links and geometry.",
        (
            FigureBlock(
                "figure-springs",
                "Predicted standard deviations",
                predicted_springs(planned, flat),
                "Farther left is better. Grey: the same poses with the same torque on every line.",
                "Predicted standard deviation of every stiffness and damping, planned and with a flat spectrum.",
            ),
            Table("table-springs", "Predicted standard deviations", heads, rows),
        ),
    )


def _poses(study: FrequencyDesignStudy) -> Section:
    plan = study.planned.plan
    blocks: list[Block] = []
    if study.curve is not None:
        blocks.append(
            FigureBlock(
                "figure-curve",
                "Number of poses",
                poses_against_std(study.curve, len(plan.poses)),
                "Each pose is added to those before it; the plan, dotted, was then improved by exchange. With flat amplitudes. Grey: the "
                "median of poses drawn from the same candidates.",
                "Largest predicted standard deviation of a stiffness against the number of poses.",
            )
        )
    if study.model.points:
        blocks.append(
            FigureBlock(
                "figure-poses",
                "The poses",
                planned_arm(study.model, plan.poses),
                "The arm from the base to the measured point, in every pose of the plan.",
                f"Skeletons of the arm in {len(plan.poses)} poses.",
            )
        )
    heads = ("pose", *(f"q{i} / °" for i in range(1, study.model.n + 1)))
    rows = tuple((str(k), *(f"{x:.1f}" for x in q)) for k, q in enumerate(np.degrees(plan.poses), start=1))
    blocks.append(Table("table-poses", "Joint positions", heads, rows))
    return Section(
        "poses",
        "Poses",
        "A single pose does not determine the springs; all poses together do.",
        tuple(blocks),
    )


def _amplitudes(study: FrequencyDesignStudy) -> Section:
    return Section(
        "amplitudes",
        "Amplitudes",
        "The torque is larger where the responses depend on the springs, but too small to move a drive with backlash across its gap.",
        (
            FigureBlock(
                "figure-amplitudes",
                "Amplitude spectrum",
                amplitude_spectrum(study.planned.plan, study.flat.plan),
                "Cosine amplitude of every line over all orthogonal experiments. Grey: the same on every line.",
                "Torque amplitude of every line of each axis, planned and flat.",
            ),
        ),
    )
