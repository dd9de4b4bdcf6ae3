"""Planning the frequency experiments of a robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.data.plans import MultisinePlan, page_beside, write_plan
from flexcal.design.frequency import (
    FrequencyPoseSelection,
    Placement,
    PlannedResponses,
    excitation_margin,
    largest_stiffness_std,
    optimal_amplitudes,
    payload_placements,
    stiffness_curve,
    within_preload,
)
from flexcal.errors import InputError
from flexcal.frequency.periodic import leave_out_detection_lines
from flexcal.jobs.experiments.optimised_excitation import (
    CANDIDATES,
    POSES,
    PlanName,
    declared_sensors,
    optimise_excitation,
    plan_without_poses,
    response_sensors,
)
from flexcal.jobs.experiments.standard_plans import frequency_plan, read_frequency_poses
from flexcal.jobs.inputs import robot_provenance
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.layout import write_page
from flexcal.report.pages import FrequencyDesignStudy, frequency_page


@dataclass(frozen=True, eq=False)
class DesignedFrequency:
    """A plan, the file it was written to and what it will tell; the `choice` of its poses and their `curve` where they were chosen.

    `flat` is the same with equal amplitudes. `curve` holds numbers of poses and the largest standard deviation of a stiffness with as many,
    chosen and at random, (3, K). `record` says what it comes from.
    """

    planned: PlannedResponses
    flat: PlannedResponses
    file: Path
    choice: FrequencyPoseSelection | None = None
    curve: np.ndarray | None = None
    placements: tuple[Placement, ...] = ()
    record: RunRecord = NOT_RECORDED

    @property
    def plan(self) -> MultisinePlan:
        """What is written."""
        return self.planned.plan

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensors on the arm that the prediction counts on."""
        named = (name.split(".")[1] for name in self.planned.parameters.names if name.startswith("sensor."))
        return tuple(dict.fromkeys(named))

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        plan = self.plan
        recordings = len(plan.poses) * plan.recordings_per_pose
        name, largest = largest_stiffness_std(self.planned.sensitivity)
        result = {
            "plan": self.file,
            "page": page_beside(self.file),
            "poses": len(plan.poses),
            "excited_axes": [joint + 1 for joint in plan.joints],
            "lines": len(plan.lines),
            "detection_lines": len(plan.detection_lines),
            "lowest_hz": float(plan.frequencies_hz[0]),
            "highest_hz": float(plan.frequencies_hz[-1]),
            "realisations": plan.realisations,
            "periods": plan.periods,
            "recordings": recordings,
            "seconds_on_the_robot": recordings * plan.duration,
            "seed": plan.seed,
            "sensors": list(self.sensors),
            "predicted_std": self.planned.std(),
            "predicted_std_flat": self.flat.std(),
            "largest_stiffness_std": {"name": name, "std": largest},
            **self.record.document(),
        }
        if self.placements:
            result["payload_placements"] = [{"com": p.com, "largest_std": p.std} for p in self.placements]
        if self.choice is None or self.curve is None:
            return result
        return result | {
            "candidates": self.choice.drawn,
            "curve": [
                {"poses": int(n), "chosen": float(chosen), "random": float(random)}
                for n, chosen, random in self.curve.T
            ],
        }


def plan_frequency_experiments(
    robot: Path,
    out: Path,
    *,
    kind: PlanName = "default",
    poses: Path | None = None,
    choose: int | None = None,
    candidates: int = CANDIDATES,
    amplitude: Literal["flat", "shaped"] | None = None,
    wanted: float | None = None,
    crest: Literal["random", "optimised"] = "random",
    detection_lines: bool = False,
    place_payload: bool = False,
    seed: int = 0,
    command: str = "",
    progress: Progress = silent,
) -> DesignedFrequency:
    """Write the plan `kind` for a robot to `out`, and a page with pictures beside it.

    `designed` and `quick` choose six poses out of random `candidates`, or `choose` of them, and shape the amplitudes; `default` and `paper`
    take the poses of frequency_poses.csv beside robot.yaml and flat amplitudes. `poses`: a file of poses to take instead, the rows of
    this plan. `amplitude` overrides how they are. `wanted`: relative standard deviation that every stiffness shall have; realisations and
    periods follow. `crest`: random phases, or ones with small peaks; with `detection_lines` one line in four is left out, to see odd
    distortion; with `place_payload` it is predicted what holding the payload elsewhere about the last axis would change in these poses.

    Raises `FlexcalError` where the robot declares no elastic joint or no controller, the poses cannot be read or excited, too few can be
    found, or the wanted standard deviation is out of reach.
    """
    model = RobotModel.from_yaml(robot)
    sensors = response_sensors(robot)
    choice = None
    placed = kind == "default" or kind == "paper"
    poses = model.path.parent / "frequency_poses.csv" if placed and poses is None else poses
    _require_all(model, kind, poses)
    if kind == "default" or kind == "paper":
        assert poses is not None
        plan = frequency_plan(model, poses, kind, seed)
        plan = leave_out_detection_lines(plan) if detection_lines else plan
        flat = planned = PlannedResponses.of(model, plan, sensors)
        if amplitude == "shaped":
            planned = PlannedResponses.of(model, optimal_amplitudes(model, flat), sensors)
    else:
        plan = plan_without_poses(model, kind, detection_lines=detection_lines, seed=seed)
        if poses is None:
            designed = optimise_excitation(
                model, plan, count=choose or POSES, candidates=candidates, sensors=sensors, progress=progress
            )
            flat, planned, choice = designed.flat, designed.planned, designed.choice
        else:
            given = read_frequency_poses(
                poses, kind, model, excitation_margin(model, plan.reference_amplitude)
            )
            flat = PlannedResponses.of(model, within_preload(model, replace(plan, poses=given)), sensors)
            planned = PlannedResponses.of(model, optimal_amplitudes(model, flat), sensors)
        planned = flat if amplitude == "flat" else planned
    if wanted is not None:
        planned = planned.reaching(wanted)
    planned = replace(planned, plan=replace(planned.plan, crest=crest))
    curve = None if choice is None else _curve(choice, seed)
    places = payload_placements(model, planned.plan, sensors, progress) if place_payload else ()
    files = [file for file in (poses, declared_sensors(robot)) if file is not None]
    designed = DesignedFrequency(
        planned, flat, out, choice, curve, places, RunRecord(robot_provenance(model, files), command)
    )
    write_plan(out, planned.plan)
    study = FrequencyDesignStudy(model, planned, flat, designed.curve, designed.document())
    write_page(page_beside(out), frequency_page(study))
    return designed


def _require_all(model: RobotModel, kind: PlanName, poses: Path | None) -> None:
    """Raise `InputError` that names everything that a plan needs and is not there, not one thing after another."""
    missing = []
    if not model.driven:
        missing.append("declares no elastic joint: add `elastic:`")
    if model.controller is None:
        n = model.n
        missing.append(
            f"declares no controller: add `controller: {{kp: […], kd: […], rate_hz: 4000}}` with {n} gains each"
        )
    if poses is not None and not poses.is_file():
        columns = ", ".join(f"q{i}_deg" for i in range(1, model.n + 1))
        missing.append(
            f"has no {poses} for the poses of the plan '{kind}': write it with the columns plan, pose, {columns}, or let --plan designed "
            "choose the poses"
        )
    if missing:
        raise InputError("E-RUN-038", f"{model.path} " + "; it ".join(missing) + ".")


def _curve(choice: FrequencyPoseSelection, seed: int) -> np.ndarray:
    most = min(2 * len(choice.poses), choice.drawn)
    counts = np.arange(1, most + 1)
    return np.array([counts, *stiffness_curve(choice, counts, np.random.default_rng([seed, 7]))])
