"""The page beside a plan of poses (`flexcal design poses`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.design.scene import has_collision_shapes, station_position
from flexcal.model.kinematics import joint_origins
from flexcal.model.robot import RobotModel
from flexcal.report.figures import joint_positions, links_at, plan_space, pose_numbers
from flexcal.report.layout import (
    Check,
    Fact,
    FigureBlock,
    Page,
    Section,
    Verdict,
    significant,
    worst,
)
from flexcal.report.sections import provenance_section

_FEW = 0.2
"""Share of the poses on the rarer flank of a backlash below which the page warns."""


@dataclass(frozen=True, eq=False)
class PoseStudy:
    """Poses `q` (N, n) of a plan for a robot, `results` as the verb prints them, and where it will work: points (W, 3) and their box."""

    model: RobotModel
    q: np.ndarray
    results: Mapping[str, Any]
    working: np.ndarray | None = None
    box: np.ndarray | None = None


def pose_page(study: PoseStudy) -> Page:
    """The page before it becomes HTML."""
    results = study.results
    checks = pose_checks(results, has_shapes=has_collision_shapes(study.model))
    status = worst(checks)
    chosen = "tool_error_mm" in results
    verdict = Verdict(
        status,
        f"{len(study.q)} poses to measure" if chosen else f"{len(study.q)} random poses, for a verification",
        _sentence(results) if chosen else _random_sentence(study.model),
        _facts(results) if chosen else (),
        (),
        "",
        checks,
    )
    sections = [
        _space(study),
        _joints(study),
        provenance_section(results["command"], results["seed"], {}, results["provenance"]),
    ]
    return Page(
        title=f"{study.model.name}: poses to measure",
        subtitle=(f"Plan {Path(results['plan']).name}, " if results["plan"] else "")
        + ("chosen from given poses" if results["seed"] is None else f"seed {results['seed']}"),
        verdict=verdict,
        sections=[_numbers(results), *sections] if chosen else sections,
        document=results,
    )


def pose_checks(results: Mapping[str, Any], *, has_shapes: bool = True) -> tuple[Check, ...]:
    """Checks of a plan before measuring; without collision shapes (`has_shapes`), collisions of moves cannot be judged."""
    checks = []
    for joint, sides in results.get("flanks", {}).items():
        least, total = min(sides.values()), sum(sides.values())
        answer = (
            f"{sides['positive']} poses press {joint} onto one flank, {sides['negative']} onto the other."
        )
        good = least >= _FEW * total or "measured" in results
        checks.append(
            Check(f"Are both flanks of the backlash of {joint} loaded?", answer, "good" if good else "care")
        )
    if approaches := results.get("approaches"):
        turning = {joint: sides for joint, sides in approaches.items() if sum(sides.values())}
        rarest = min(turning, key=lambda joint: min(turning[joint].values()), default=None)
        if rarest is not None:
            sides = turning[rarest]
            answer = (
                f"They come to the poses by way of a point 2° before, from either side: {rarest} to {sides['positive']} in its positive "
                f"direction and to {sides['negative']} in the negative one, the others no less evenly."
            )
            good = min(sides.values()) >= _FEW * sum(sides.values())
            checks.append(Check("Do the joints come from both sides?", answer, "good" if good else "care"))
    if (working := results.get("working")) is not None:
        share = working["reached_share"]
        answer = f"Of the working volume the robot reaches {100 * share:.0f} %."
        checks.append(
            Check("Does the robot reach its working volume?", answer, "good" if share > 0.9 else "care")
        )
    if "blocked_moves" in results:
        blocked = results["blocked_moves"]
        ways = ", ".join(f"{a} to {b}" for a, b in blocked)
        answer = (
            f"There are collisions on the straight joint motion from {ways}: go round there."
            if blocked and has_shapes
            else f"The target goes below the base plane on the straight joint motion from {ways}; collisions are not checked."
            if blocked
            else "There are no collisions on them."
            if has_shapes
            else "Not checked: the URDF has no collision shapes."
        )
        status = "care" if blocked else "good" if has_shapes else "unknown"
        checks.append(Check("Are the moves between the poses free of collisions?", answer, status))
    return tuple(checks)


def _random_sentence(model: RobotModel) -> str:
    """What random poses are; only what was checked."""
    if not has_collision_shapes(model):
        return "They cover the joint ranges; collisions are not checked, as the URDF has no collision shapes. Move there slowly and look."
    sight = "" if station_position(model) is None else " and visible to the instrument"
    return f"They cover the joint ranges and are free of collisions{sight}."


def _sentence(results: Mapping[str, Any]) -> str:
    if "measured" not in results:
        prior = results.get("prior")
        with_prior = (
            ""
            if prior is None
            else f" To be calibrated with the prior of {len(prior['robots'])} other robots, {prior['file']}: {prior['sentence']}."
        )
        told = results.get("size") if results.get("measure") is not None else None
        size = "" if told is None else f" How large the robot is: {told['sentence']}."
        return (
            f"Measured with {results['instrument']}, they predict a tool error of {significant(results['tool_error_mm'], 3)} mm from its "
            f"noise alone; no choice of as many reaches less than {significant(results['least_possible_mm'], 3)} mm.{size}{with_prior}"
        )
    errors, poses = results["tool_error_mm"], results["poses"]
    end = "then stop" if results["stop_after"] is not None else "go on after them"
    return (
        f"After the {results['measured']} measured poses the predicted tool error is {significant(errors[0], 3)} mm from noise "
        f"alone; after these {poses} it is {significant(errors[poses], 3)} mm: {end}."
    )


def _facts(results: Mapping[str, Any]) -> tuple[Fact, ...]:
    where = "over the whole workspace" if results["working"] is None else "over the working volume"
    if "measured" in results:
        errors, poses = results["tool_error_mm"], results["poses"]
        return (
            Fact("How good is it now?", significant(errors[0], 3), "mm", f"Predicted tool error {where}."),
            Fact(
                "How good will it be?",
                significant(errors[poses], 3),
                "mm",
                f"After these {poses} poses, the best first.",
            ),
        )
    error, least = results["tool_error_mm"], results["least_possible_mm"]
    return (
        Fact("What accuracy is possible?", significant(error, 3), "mm", f"Root mean square {where}, from noise alone."),
        Fact("How far from the optimum is it?", f"≤ {100 * (error / least - 1):.0f}", "%", "Upper bound of the excess over the best choice "
        "of as many poses."),
        Fact("How long are the moves?", f"{results['moves_s']:.0f}", "s", "At least: all joints at once, none faster than its limit."),
    )  # fmt: skip


def _numbers(results: Mapping[str, Any]) -> Section:
    errors: dict[str, list[float]]
    if "measured" in results:
        numbers = [results["measured"] + k for k in range(len(results["tool_error_mm"]))]
        errors = {"chosen one after the other": list(results["tool_error_mm"])}
        errors["no choice is below"] = list(results["least_possible_mm"])
        desired_error, plan = results["wanted_mm"], results["measured"] + results["poses"]
    else:
        curve = results["curve"]
        numbers = [point["poses"] for point in curve]
        errors = {"chosen one by one": [point["tool_error_mm"] for point in curve]}
        errors["at random, median"] = [point["random_mm"] for point in curve]
        desired_error, plan = None, results["poses"]
    block = FigureBlock(
        "figure-numbers",
        "Predicted tool error against the number of poses",
        pose_numbers(numbers, errors, plan, desired_error),
        "Where four times the poses halve the error, further poses only average noise. The dashed line is this plan. From the "
        "instrument's noise alone, without deflection and repeatability.",
        f"Predicted tool error in mm against {len(numbers)} numbers of poses.",
    )
    return Section("numbers", "Number of poses", "", (block,))


def _space(study: PoseStudy) -> Section:
    corners = joint_origins(study.model, study.q)
    block = FigureBlock(
        "figure-space",
        "The poses in the robot's base frame",
        plan_space(
            corners,
            links_at(study.model, study.q[:1])[0],
            study.working,
            study.box,
            station_position(study.model),
        ),
        "The links in the first pose, and the arm as lines in the others; the blue line connects the target positions in the order of "
        "the plan. Drag to rotate, Ctrl and the wheel to zoom.",
        f"The arm in {len(study.q)} poses, in three dimensions.",
    )
    return Section("space", "Poses in space", "", (block,))


def _joints(study: PoseStudy) -> Section:
    block = FigureBlock(
        "figure-joints",
        "Joint positions between their limits",
        joint_positions(study.model, study.q),
        "One mark a pose. A joint without limits is drawn over a turn.",
        f"Positions of {study.model.n} joints in {len(study.q)} poses.",
    )
    return Section("joints", "Joint positions", "", (block,))
