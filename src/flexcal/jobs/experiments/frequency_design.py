"""Planning the frequency experiments of a robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.data.plans import MultisinePlan, page_beside, write_plan
from flexcal.design.frequency import (
    COMMON_SENSORS,
    FrequencyPoseSelection,
    Placement,
    PlannedResponses,
    ResponseSensors,
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
from flexcal.jobs.experiments.standard_plans import read_frequency_poses, reference_amplitude, standard_plan
from flexcal.jobs.inputs import robot_provenance
from flexcal.jobs.pages import PlottedResult
from flexcal.jobs.result_files import NOT_RECORDED, RunRecord
from flexcal.model.robot import RobotModel
from flexcal.progress import Progress, silent
from flexcal.report.layout import Page
from flexcal.report.pages import FrequencyDesignStudy, frequency_page


@dataclass(frozen=True, eq=False)
class FrequencyRequest:
    """Requested frequency experiments of `design_frequency`.

    Parameters
    ----------
    kind : {"designed", "quick", "default", "paper"}
        For designed and quick, poses are chosen and amplitudes are shaped; default and paper take given poses and flat amplitudes.
    poses : ndarray, optional
        Poses (P, n), rad, to take instead of chosen ones; default and paper need them.
    choose, candidates : int
        Number of poses that are chosen, out of so many random ones.
    amplitude : {"flat", "shaped"}, optional
        How the amplitudes are, in place of what the kind says.
    desired_std : float, optional
        Relative standard deviation that every stiffness shall have; realisations and periods follow.
    crest : {"random", "optimised"}
        Random phases, or ones with small peaks.
    detection_lines : bool
        Whether one line in four is left out, to see odd distortion.
    place_payload : bool
        Whether it is predicted what holding the payload elsewhere about the last axis would change in these poses.
    seed : int
        Seed of poses and phases.
    """

    kind: PlanName = "designed"
    poses: np.ndarray | None = None
    choose: int = POSES
    candidates: int = CANDIDATES
    amplitude: Literal["flat", "shaped"] | None = None
    desired_std: float | None = None
    crest: Literal["random", "optimised"] = "random"
    detection_lines: bool = False
    place_payload: bool = False
    seed: int = 0


DEFAULT_REQUEST = FrequencyRequest()


@dataclass(frozen=True, eq=False, repr=False)
class DesignedFrequency(PlottedResult):
    """Result of `design_frequency`: a plan of frequency experiments and its predicted precision.

    Attributes
    ----------
    model : RobotModel
        The robot that the plan is for.
    planned : PlannedResponses
        The plan with its predicted standard deviations.
    flat : PlannedResponses
        The same with equal amplitudes.
    choice : FrequencyPoseSelection or None
        Choice of the poses, where they were chosen.
    curve : ndarray or None
        Numbers of poses, and the largest standard deviation of a stiffness with as many, chosen and at random, (3, K).
    placements : tuple of Placement
        What holding the payload elsewhere would change.
    file : Path or None
        File of the plan, where it was written.
    record : RunRecord
        What the result comes from.
    """

    planned: PlannedResponses
    flat: PlannedResponses
    choice: FrequencyPoseSelection | None = None
    curve: np.ndarray | None = None
    placements: tuple[Placement, ...] = ()
    file: Path | None = None
    record: RunRecord = NOT_RECORDED

    @property
    def headline(self) -> str:
        """Size of the plan, and the stiffness with the largest predicted standard deviation."""
        name, largest = largest_stiffness_std(self.planned.sensitivity)
        plan = self.plan
        return f"{len(plan.poses)} poses, {len(plan.lines)} lines, largest standard deviation {100 * largest:.2f} % ({name})"

    def summary(self) -> str:
        """Size of the plan, and the predicted relative standard deviations."""
        return "\n".join(
            [self.headline, *(f"{name:<40} {std:.4f}" for name, std in self.planned.std().items())]
        )

    def _page(self) -> Page:
        study = FrequencyDesignStudy(self.model, self.planned, self.flat, self.curve, self.document())
        return frequency_page(study)

    @property
    def plan(self) -> MultisinePlan:
        """Plan to be written."""
        return self.planned.plan

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the arm-side sensors assumed in the prediction."""
        named = (name.split(".")[1] for name in self.planned.parameters.names if name.startswith("sensor."))
        return tuple(dict.fromkeys(named))

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        plan = self.plan
        recordings = len(plan.poses) * plan.recordings_per_pose
        name, largest = largest_stiffness_std(self.planned.sensitivity)
        result = {
            "plan": self.file,
            "page": None if self.file is None else page_beside(self.file),
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


def design_frequency(
    model: RobotModel,
    request: FrequencyRequest = DEFAULT_REQUEST,
    *,
    sensors: ResponseSensors = COMMON_SENSORS,
    progress: Progress = silent,
) -> DesignedFrequency:
    """Plan the frequency experiments of a robot, and predict how precisely they determine its springs.

    Parameters
    ----------
    model : RobotModel
        Robot with elastic joints and a controller.
    request : FrequencyRequest
        Kind of plan, poses, amplitudes, and what is asked of it.
    sensors : ResponseSensors
        Resolution of the encoders and noise of the torques.
    progress : Progress
        Called with the stage and the share of it that is done.

    Returns
    -------
    DesignedFrequency
        Its `plan`, the predicted standard deviations `planned.std()`, `summary()` and `report(path)`.

    Raises
    ------
    FlexcalError
        Where the robot declares no elastic joint or no controller, poses are missing or cannot be excited, too few can be found, or the
        desired standard deviation is out of reach.

    Examples
    --------
    Equal amplitudes in one pose; by default poses are chosen and amplitudes shaped.

    >>> import numpy as np
    >>> from flexcal import FrequencyRequest, RobotModel, design_frequency
    >>> model = RobotModel.from_yaml("examples/tx90l/robot.yaml", estimates=False)
    >>> poses = np.array([[0.0, -0.5, -1.6, 0.65, -1.7, 0.0]])
    >>> design = design_frequency(model, FrequencyRequest(kind="default", poses=poses))
    >>> design.plan.joints
    (0, 1, 2)
    """
    _require_all(model, request)
    kind, poses, choice = request.kind, request.poses, None
    if kind == "default" or kind == "paper":
        assert poses is not None
        plan = standard_plan(model, poses, kind, request.seed)
        plan = leave_out_detection_lines(plan) if request.detection_lines else plan
        flat = planned = PlannedResponses.of(model, plan, sensors)
        if request.amplitude == "shaped":
            planned = PlannedResponses.of(model, optimal_amplitudes(model, flat), sensors)
    else:
        plan = plan_without_poses(model, kind, detection_lines=request.detection_lines, seed=request.seed)
        if poses is None:
            designed = optimise_excitation(
                model,
                plan,
                count=request.choose,
                candidates=request.candidates,
                sensors=sensors,
                progress=progress,
            )
            flat, planned, choice = designed.flat, designed.planned, designed.choice
        else:
            flat = PlannedResponses.of(model, within_preload(model, replace(plan, poses=poses)), sensors)
            planned = PlannedResponses.of(model, optimal_amplitudes(model, flat), sensors)
        planned = flat if request.amplitude == "flat" else planned
    if request.desired_std is not None:
        planned = planned.reaching(request.desired_std)
    planned = replace(planned, plan=replace(planned.plan, crest=request.crest))
    places = payload_placements(model, planned.plan, sensors, progress) if request.place_payload else ()
    curve = None if choice is None else _curve(choice, request.seed)
    return DesignedFrequency(model, planned, flat, choice, curve, places)


def plan_frequency_experiments(
    robot_file: Path,
    out: Path,
    request: FrequencyRequest,
    *,
    poses: Path | None = None,
    command: str = "",
    progress: Progress = silent,
) -> DesignedFrequency:
    """`design_frequency` for the robot of a robot.yaml; the plan goes to `out`, its page beside it.

    `poses` is a file whose rows of this plan are taken; by default, for `default` and `paper`, frequency_poses.csv beside robot.yaml.
    The sensors are those of cell.yaml beside it, if there is one. Raises `FlexcalError` as reading and `design_frequency` do.
    """
    model, kind = RobotModel.from_yaml(robot_file), request.kind
    if poses is None and (kind == "default" or kind == "paper"):
        poses = model.path.parent / "frequency_poses.csv"
    _require_all(model, request, poses)
    if poses is not None:
        room = excitation_margin(model, reference_amplitude(kind))
        request = replace(request, poses=read_frequency_poses(poses, kind, model, room))
    designed = design_frequency(model, request, sensors=response_sensors(robot_file), progress=progress)
    files = [file for file in (poses, declared_sensors(robot_file)) if file is not None]
    result = replace(designed, file=out, record=RunRecord(robot_provenance(model, files), command))
    write_plan(out, result.plan)
    result.report(page_beside(out))
    return result


def _require_all(model: RobotModel, request: FrequencyRequest, file: Path | None = None) -> None:
    """Raise one `InputError` that names all missing requirements of a plan."""
    missing = []
    if not model.driven:
        missing.append("declares no elastic joint: add `elastic:`")
    if model.controller is None:
        n = model.n
        missing.append(
            f"declares no controller: add `controller: {{kp: […], kd: […], rate_hz: 4000}}` with {n} gains each"
        )
    placed = request.kind in ("default", "paper") and request.poses is None
    if (placed and file is None) or (file is not None and not file.is_file()):
        columns = ", ".join(f"q{i}_deg" for i in range(1, model.n + 1))
        missing.append(
            f"has no {file or 'file'} for the poses of the plan '{request.kind}': write it with the columns plan, pose, {columns}, or let "
            "--plan designed choose the poses"
        )
    if missing:
        raise InputError("E-RUN-038", f"{model.path} " + "; it ".join(missing) + ".")


def _curve(choice: FrequencyPoseSelection, seed: int) -> np.ndarray:
    most = min(2 * len(choice.poses), choice.drawn)
    counts = np.arange(1, most + 1)
    return np.array([counts, *stiffness_curve(choice, counts, np.random.default_rng([seed, 7]))])
