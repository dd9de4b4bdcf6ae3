"""The page beside a plan of exciting trajectories (`flexcal design trajectory`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexcal.design.trajectories import NEAR, TrajectoryDesign
from flexcal.model.kinematics import joint_origins, link_frames
from flexcal.report.figures import limit_shares, links_at, prior_gains, swept_paths
from flexcal.report.layout import (
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Selector,
    Table,
    Verdict,
    significant,
    tally,
    worst,
)
from flexcal.report.sections import provenance_section

_INSTANTS = 400


def trajectory_page(design: TrajectoryDesign, document: Mapping[str, Any]) -> Page:
    """The page before it becomes HTML; `document` is the plan's results.json."""
    plan = design.plan
    motions = "trajectory" if len(plan) == 1 else "trajectories"
    return Page(
        title=f"{design.model.name}: exciting trajectories",
        subtitle=f"{len(plan)} {motions} of {plan.periods} periods of {1 / plan.base_frequency_hz:g} s, criterion "
        f"{design.goal.criterion.name}",
        verdict=_verdict(design, document),
        sections=[
            _motions(design),
            _knowledge(design, document),
            provenance_section(document["command"], document["seed"], {}, document["provenance"]),
        ],
        document=document,
    )


def check_clearance(clearance: float | None) -> Check:
    """Whether the motions are free of collisions, by the least `clearance` beyond the margin, m, up to 0.05; None without shapes."""
    question = "Is it free of collisions?"
    if clearance is None:
        return Check(
            question,
            "Cannot be judged: the URDF has no collision shapes. Run the motion in a simulator, or slowly, first.",
            "care",
        )
    if clearance <= 0:
        return Check(question, "Bodies collide.", "bad")
    least = "50 mm or more" if clearance >= NEAR else f"{1e3 * clearance:.0f} mm"
    return Check(question, f"The smallest clearance is {least} beyond the margin.", "good")


def _verdict(design: TrajectoryDesign, document: Mapping[str, Any]) -> Verdict:
    uses = document["largest_shares"]
    checks = (
        Check(
            "Are all limits kept?",
            f"At most {100 * uses['position']:.1f} % of the ranges, {100 * uses['velocity']:.1f} % of the velocities and "
            f"{100 * uses['torque']:.1f} % of the torques that the design may use, on a grid ten times finer than that of the search.",
            "good" if max(uses.values()) <= 1 else "bad",
        ),
        check_clearance(document["clearance"]),
        Check(
            "Are all base parameters excited?",
            f"The condition number of the column-scaled observation matrix is {significant(document['condition'], 3)}; up to 100 is good.",
            "good" if document["condition"] < 100 else "care",
        ),
    )
    status = worst(checks)
    facts = (
        Fact(
            "How long does it take?",
            significant(document["seconds_on_the_robot"], 3),
            "s",
            "On a real robot.",
        ),
        Fact(
            "How well are the parameters excited?",
            significant(document["condition"], 3),
            "",
            f"Condition number of the observation matrix of {document['base_parameters']} base parameters, columns of unit norm.",
        ),
        Fact("Can I run it?", "Yes" if status == "good" else "With care", "", f"{tally(checks)}.", status),
    )
    headline = (
        "The motions keep all limits"
        if status == "good"
        else "Read the checks below before running the motions"
    )
    sentence = " ".join(
        [
            f"Limits are those of the URDF and of robot.yaml, for the nominal robot with its "
            f"{'assumed' if document['assumed_friction'] else 'declared'} friction.",
            *(f"{remark[0].upper()}{remark[1:]}." for remark in document["remarks"]),
        ]
    )
    return Verdict(status, headline, sentence, facts, (), "", checks)


def _motions(design: TrajectoryDesign) -> Section:
    plan, joints = design.plan, design.model.joint_names
    time = np.arange(_INSTANTS) / (_INSTANTS * plan.base_frequency_hz)
    labels = [str(number) for number in range(1, len(plan) + 1)]
    motions = [np.array(plan.motion(number, time)) for number in range(len(plan))]
    choice = (Selector("trajectory", "trajectory", tuple(labels)),) if len(plan) > 1 else ()
    shares = {label: design.shares(motion) for label, motion in zip(labels, motions, strict=True)}
    chains = {label: _corners(design, motion[0]) for label, motion in zip(labels, motions, strict=True)}
    begins = np.array([motion[0][0] for motion in motions])
    links = dict(zip(labels, links_at(design.model, begins), strict=True))
    return Section(
        "motions",
        "The motions",
        "Every trajectory repeats one period; the robot moves slowly to the start of the first.",
        (
            FigureBlock(
                "figure-paths",
                "Path through space",
                swept_paths(chains, links),
                "Blue is the path of the target point, or of the last joint where robot.yaml declares no point; grey is the arm on its "
                "way, and its links are drawn where a period begins.",
                "Path of the end of the arm in three dimensions with the arm at some instants.",
                choice,
            ),
            FigureBlock(
                "figure-shares",
                "Joints against their limits",
                limit_shares(time, joints, shares),
                "Positions from the lower (−100 %) to the upper end of the permitted range; velocities, and motor torques "
                "with friction, relative to the permitted fraction of the limits.",
                f"Shares of the limits of position, velocity and torque of {len(joints)} joints over one period.",
                choice,
            ),
        ),
    )


def _corners(design: TrajectoryDesign, q: np.ndarray) -> np.ndarray:
    model = design.model
    if model.points:
        return joint_origins(model, q)
    origins = link_frames(model, q)[1]
    return np.concatenate([np.zeros((len(q), 1, 3)), origins], axis=1)


def _knowledge(design: TrajectoryDesign, document: Mapping[str, Any]) -> Section:
    gained = document["prior_gain"]
    names, after = list(gained), np.array(list(gained.values()), dtype=float)
    rows = tuple((name, f"{share:.3g}") for name, share in zip(names, after, strict=True))
    blocks = (
        FigureBlock(
            "figure-gain",
            "Predicted reduction of the standard deviations",
            prior_gains(names, after),
            "Predicted standard deviations with these trajectories and robot.yaml's prior, over those of the prior alone, for torque noise "
            "of 0.1 % of the efforts; 1 means no information.",
            f"Ratio of standard deviations after and before for {len(names)} parameters.",
        ),
        Table("table-gain", "The same in numbers", ("parameter", "after / before"), rows, folded=True),
    )
    lead = "Masses, centres of mass and rotor inertias have robot.yaml's prior; friction has none, and is estimated with them."
    return Section("knowledge", "Predicted information", lead, blocks if names else ())
