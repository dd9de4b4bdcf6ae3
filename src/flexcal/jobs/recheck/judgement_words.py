"""The judgement of a visit in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexcal.calibration.recheck import (
    FALSE_ALARM,
    OF_THE_MEASUREMENT,
    VISIT_ALARM,
    FittedPair,
    JudgedVisit,
    MovedTool,
    PossibleChange,
    Suspect,
    TellingPose,
    is_no_warmth,
)
from flexcal.jobs.recheck.visit_course import CourseOverVisits
from flexcal.model.robot import EXPANSION, RobotModel
from flexcal.report.results import amount, chance_in_words
from flexcal.units import MILLIMETRE

_LEAST_CHANCE = 1e-4
"""Least probability that the draws of the test tell."""
_KELVIN = 12e-6
"""Growth of steel, m/m/K."""
_CLEAR = 4.0
"""Distance, in standard deviations of a mean of readings, that tells two points apart."""
_SMALL = 0.5
"""Share of the calibrated robot's expected error below which a displacement of the tool hardly matters."""


def judgement_sentence(judged: JudgedVisit, course: CourseOverVisits | None = None) -> str:
    """What the visit says of the robot; with the `course` over all visits, since when, and at which rate."""
    chance = chance_in_words(judged.probability, _LEAST_CHANCE)
    errors = judged.test.errors
    count = len(errors.errors) / 3
    size = (
        f"{chance}, errors of {np.sqrt(errors.errors @ errors.errors / count) / MILLIMETRE:.3f} mm rms where "
        f"{np.sqrt(np.trace(errors.covariance) / count) / MILLIMETRE:.3f} are expected"
    )
    moved = judged.instrument == "evident"
    if judged.as_calibrated:
        if moved:
            place = "the instrument, or the base of the robot, stands elsewhere"
            told = place if judged.place is None else suspect_in_words(judged.place, judged.test.errors.model)
            rivals = ""
            if judged.rivals is not None:
                rivals = f"; {_together(judged.rivals)} together would explain the readings too"
            return (
                f"{told}; beside that the robot is as calibrated{_as_far_as_seen(judged)} ({chance}; false alarms {VISIT_ALARM:.1%})"
                f"{rivals}"
            )
        return f"as calibrated ({chance}; false alarms {VISIT_ALARM:.1%})"
    # where lengths are in another unit, so is the place of the instrument
    moved = moved and not any(is_no_warmth(suspect) for suspect in judged.suspects)
    lead = "the instrument, or the base of the robot, stands elsewhere; beside that: " if moved else ""
    if judged.scatter is not None:
        usual = "repeated readings of these poses" if errors.noise == "repeats" else "at the calibration"
        scatters = (
            f"the readings scatter {judged.scatter.factor:.1f} times as much as {usual} ({chance_in_words(judged.scatter.chance)}): check "
            "the instrument and its targets, and the robot for play in joints and tool, and measure again"
        )
        if judged.geometry:
            scatters += "; the geometry in several places, as of another robot, would explain them too"
        elif not judged.suspects and judged.rivals is not None:
            scatters += f"; so would {_together(judged.rivals)} together"
        elif not judged.suspects and judged.together > FALSE_ALARM:
            scatters += "; several changes of the robot together would explain them too"
        if not judged.suspects:
            return f"{lead}{scatters}; whether the robot changed too cannot be told by them ({chance} of the whole)"
        lead = f"{lead}{scatters}; what is more than such scatter: "
    if not judged.suspects:
        several = (
            f"{lead}recalibrate ({size}): no single change of a joint, of the tool, of all lengths, of the load or of the instrument "
            "explains the errors; "
            + (
                "several together would"
                if judged.rivals is None
                else f"two together would, as {_together(judged.rivals)}"
            )
        )
        if judged.together > FALSE_ALARM:
            another = ", as after a crash, and so would the geometry of another robot: is this the one that was calibrated?"
            return several + (another if judged.geometry else ", or play in a gear, or a link that bent")
        if judged.geometry:
            return (
                f"{lead}recalibrate ({size}): the errors are not those of shifted joints, a bumped tool, growth or a moved instrument, nor "
                "noise, but go together as those of a robot whose geometry differs in many places: is this the robot that was calibrated?"
            )
        return (
            f"{lead}recalibrate ({size}): the errors are not those of shifted joints, a bumped tool, growth or a moved instrument, all "
            "together; if this may be another robot, poses were not those commanded, or the instrument is noisier than at the calibration, "
            "mend that and measure again first"
        )
    if course is not None and course.drifting:
        return f"{lead}{course.drift_words} ({chance})"
    told = ", or ".join(suspect_in_words(s, judged.test.errors.model) for s in judged.suspects)
    if judged.geometry and judged.scatter is None:
        told += ", or the geometry in several places, as of another robot"
    since = "" if course is None else course.since_words
    if len(judged.suspects) == 1:
        return f"{lead}{told} (beyond chance: {chance}; no other single change explains the readings){since}"
    return f"{lead}something changed ({chance}), and these readings do not tell which: {told}{since}"


def _together(pair: FittedPair) -> str:
    return " and ".join(change_name(change) for change in pair.changes)


def effect_sentence(judged: JudgedVisit, tools: Sequence[MovedTool], expected: float) -> str:
    """How far the most likely change moved the tool, from `tools` of all suspects, beside the `expected` error of the calibrated robot, m;
    empty where nothing is named.
    """
    if judged.as_calibrated or not judged.suspects:
        return ""
    if len(judged.suspects) == 1:
        return _effect(judged.suspects[0], tools[0], expected)
    told = [
        f"if it was {suspect_name(suspect)}, "
        + (
            "the tool is where it was"
            if suspect.change.kind in OF_THE_MEASUREMENT
            else f"the tool is off by {tool.p95 / MILLIMETRE:.3f} mm at 95 % of the poses"
        )
        for suspect, tool in zip(judged.suspects, tools, strict=True)
    ]
    return f"; {', '.join(told)}"


def _as_far_as_seen(judged: JudgedVisit) -> str:
    """Joints whose shift is not seen beside the fitted place of the instrument."""
    unseen = [change.subject for change in judged.test.unseen if change.kind == "joint_shifted"]
    if not unseen:
        return ""
    return f", as far as it can be seen then: a shift of {' or '.join(unseen)} looks just like another place of the instrument"


def telling_sentence(judged: JudgedVisit, telling: TellingPose | None, noise: float) -> str:
    """What would tell the two best suspects apart; empty where there is one. `noise` is that of a reading, m."""
    if len(judged.suspects) < 2:
        return ""
    kinds = {suspect.change.kind for suspect in judged.suspects[:2]}
    first, second = (suspect_name(s) for s in judged.suspects[:2])
    if "noisier_readings" in kinds:
        return f"what tells {first} from {second}: the same poses measured again, each several times"
    if "instrument_moved" in kinds:
        return (
            f"what tells {first} from {second}: a point that is fixed to the robot's base, measured with the others; it moves with the "
            "instrument alone"
        )
    if "readings_drift" in kinds:
        return f"what tells {first} from {second}: the poses measured again in another order, once the instrument has settled"
    if "wrong_reading" in kinds:
        pose = next(s.change.subject for s in judged.suspects[:2] if s.change.kind == "wrong_reading")
        return f"what tells {first} from {second}: pose {pose} measured again"
    if judged.suspects[1].same:
        subjects = {suspect.change.subject for suspect in judged.suspects[:2]}
        if len(judged.test.errors.poses.targets) > 1 or not subjects & set(judged.test.errors.poses.targets):
            return f"no pose of these points tells {first} from {second}; look at how the tool is mounted"
        return (
            f"no pose of this point tells {first} from {second}; a second point on the tool, measured at the same poses, tells whether one "
            "point alone moved"
        )
    if telling is None:
        return ""
    q = ", ".join(f"{value:.3f}" for value in telling.q)
    readings = int(np.ceil((_CLEAR * noise / telling.apart) ** 2))
    return (
        f"the pose that best tells {first} from {second}: q = {q}, where they put the point "
        f"{telling.apart / MILLIMETRE:.3f} mm apart"
        + (f", which takes about {readings} readings" if readings > 1 else "")
    )


def suspect_name(suspect: Suspect) -> str:
    """Name of a suspected change without its size."""
    return change_name(suspect.change)


def change_name(change: PossibleChange) -> str:
    """Name of a change without its size."""
    subject = change.subject
    return {
        "joint_shifted": f"a shift of {subject}",
        "tool_bumped": f"a bump of {subject}",
        "thermal_growth": "thermal growth",
        "payload_changed": "another payload" if subject == "payload" else f"another load at {subject}",
        "joint_softer": f"another compliance of {subject}",
        "two_changes": " and ".join(change_name(part) for part in change.parts),
        "gear_worn": f"play in the gear of {subject}",
        "instrument_moved": "another place of the instrument",
        "wrong_reading": f"a wrong reading of pose {subject}",
        "readings_drift": "a drift of the readings",
        "noisier_readings": "more scatter of the readings",
    }[change.kind]


def suspect_in_words(suspect: Suspect, model: RobotModel) -> str:
    """A change of a calibrated robot with its size and 95 % half-width."""
    change, values, stds = suspect.change, suspect.estimate, suspect.quantile * suspect.std
    value, half = float(values[0]), float(stds[0])
    if change.kind == "joint_shifted":
        return f"{change.subject} shifted by {amount(value, half, change.units[0])}"
    if change.kind == "gear_worn":
        play = amount(value, half, change.units[0]).lstrip("+")
        return (
            f"play in the gear of {change.subject}: {play} to either side, as of a worn gear or a loose belt"
        )
    if is_no_warmth(suspect):
        return (
            f"all lengths are {1 + value:.5g} times those of the robot, which no temperature does: the points are in another unit, or the "
            "scale of the instrument is off"
        )
    if change.kind == "thermal_growth":
        return (
            f"thermal growth: all lengths by {amount(1e6 * value, 1e6 * half, 'µm/m')} ({_as_warmth(value, model)}), unless it is the "
            "scale of the instrument"
        )
    if change.kind == "two_changes":
        count = len(change.parts[0].names)
        parts = zip(change.parts, (slice(count), slice(count, None)), strict=True)
        told = " and ".join(
            suspect_in_words(
                replace(
                    suspect,
                    change=part,
                    estimate=values[own],
                    std=suspect.std[own],
                    covariance=suspect.covariance[own, own],
                ),
                model,
            )
            for part, own in parts
        )
        return f"two changes together, as {told}"
    if change.names == ("payload.sag",):
        what = (
            "another payload"
            if change.subject == "payload"
            else f"a load at {change.subject} that is not declared"
        )
        return f"{what}, whose mass is not known, as the calibrated robot is rigid"
    if change.kind == "payload_changed" and change.subject == "payload":
        return f"the payload changed by {amount(value, half, 'kg')}"
    if change.kind == "payload_changed":
        return f"a load that is not declared, {amount(value, half, 'kg')} at {change.subject}"
    if change.kind == "joint_softer":
        return f"{change.subject} yields {_compliance(value, half, model.value(change.names[0]))}"
    if change.kind == "noisier_readings":
        return f"the readings scatter {value:.1f} times as much as is expected of them: check the instrument, and measure them again"
    size = float(np.linalg.norm(values[:3]))
    # half-width along the displacement itself
    along = values[:3] / max(size, 1e-30)
    half = suspect.quantile * float(np.sqrt(along @ suspect.covariance[:3, :3] @ along))
    told = f"{size / MILLIMETRE:.3f} ± {half / MILLIMETRE:.3f} mm"
    if change.kind == "tool_bumped":
        turned = f" and turned by {np.linalg.norm(values[3:]) * 1e3:.2f} mrad" if len(values) > 3 else ""
        return f"tool bumped: {change.subject} moved by {told}{turned}"
    if change.kind == "wrong_reading":
        return f"pose {change.subject} disagrees on its own, by {told}: measure it again"
    if change.kind == "readings_drift":
        return f"instrument or robot drifted by {told} from the first pose of the visit to the last: let both settle, and measure it again"
    turned = float(np.linalg.norm(values[3:]))
    return f"the instrument, or the base of the robot, stands elsewhere by {told} and {turned * 1e3:.3f} mrad"


def _compliance(value: float, half: float, calibrated: float) -> str:
    """Change of the compliance of a joint, rad/(N m), and its share of what was calibrated."""
    share = f", {abs(value) / calibrated:.0%} of what was calibrated" if calibrated > half else ""
    told = f"{1e6 * abs(value):.3g} ± {1e6 * half:.2g} µrad/(N m)"
    return f"{'more' if value > 0 else 'less'} to gravity, by {told}{share}"


def _as_warmth(growth: float, model: RobotModel) -> str:
    """Growth of all lengths, m/m, as a change of temperature: by the arm's own coefficient where it is known to a third."""
    expansion, posterior = model.value(EXPANSION), model.posterior
    if posterior.determines(EXPANSION) and expansion > 3 * np.sqrt(posterior.marginal([EXPANSION])[0, 0]):
        told = f"as {growth / expansion:+.1f} K of this arm, whose calibrated expansion is {1e6 * expansion:.1f} µm/m/K"
    else:
        told = f"as {growth / _KELVIN:+.1f} K of steel"
    return told.replace("-", "−")


def _effect(suspect: Suspect, tool: MovedTool, expected: float) -> str:
    if suspect.change.kind == "instrument_moved" or is_no_warmth(suspect):
        return ""
    if suspect.change.kind in ("wrong_reading", "readings_drift"):
        return "; beside that the robot is as calibrated"
    low, high = (value / MILLIMETRE for value in tool.p95_interval)
    told = (
        f"; the tool is off by {tool.mean / MILLIMETRE:.3f} mm on average and {tool.p95 / MILLIMETRE:.3f} mm ({low:.3f} to {high:.3f}) at "
        "95 % of the poses within the calibrated joint ranges"
    )
    if tool.p95_interval[1] < _SMALL * expected:
        told += f": significant, but small beside the {expected / MILLIMETRE:.3f} mm that are expected of the calibrated robot"
    return told
