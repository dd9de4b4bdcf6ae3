"""Frequency responses from the recordings of a frequency experiment, one response matrix per pose."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexcal.data.experiments import PLAN, FolderCell, existing_file, labels
from flexcal.data.plans import MultisinePlan, write_plan
from flexcal.data.recordings import Recording
from flexcal.errors import InputError
from flexcal.files.formats import provenance
from flexcal.frequency.periodic import (
    Average,
    FrequencyResponse,
    frequency_responses,
    local_polynomial_responses,
    reciprocity,
)
from flexcal.jobs.result_files import RunRecord, header, write_results
from flexcal.model.robot import RobotModel, sensor_column
from flexcal.progress import Progress, silent
from flexcal.report.checks import Trust, response_checks
from flexcal.report.results import relative_to_diagonal


@dataclass(frozen=True, eq=False)
class IdentifiedResponses:
    """Measured frequency responses by pose, and the files that hold them.

    `record` says what they come from. `declared` names the sensors on the arm of robot.yaml.
    """

    responses: tuple[FrequencyResponse, ...]
    files: tuple[Path, ...]
    robot: str
    record: RunRecord
    declared: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """The content of results.json; the relative numbers are medians over lines and diagonal elements."""
        return {
            **header("response"),
            "robot": self.robot,
            "responses": self._entries,
            "reciprocity": self._pairs,
            "verdict": self.trust.document(),
            **self.record.document(),
        }

    @cached_property
    def trust(self) -> Trust:
        """The verdict, from the same checks as on the page."""
        results = {"responses": self._entries, "reciprocity": self._pairs}
        return Trust(response_checks(results, self.responses))

    @property
    def sensor_remarks(self) -> tuple[str, ...]:
        """Remarks on the recorded arm-side sensors, and on declared ones without recordings."""
        recorded = dict.fromkeys(name for response in self.responses for name in response.sensors)
        remarks = [
            f"sensor {name} on the arm: 1σ {100 * worst:.2g} % of its response, in the worst pose"
            for name in recorded
            for worst in (max(entry["sensors"].get(name, 0.0) for entry in self._entries),)
        ]
        remarks += [
            f"robot.yaml declares the sensor {name}, but the logs have no column {sensor_column(name)}: it is not used"
            for name in self.declared
            if name not in recorded
        ]
        return tuple(remarks)

    @cached_property
    def _entries(self) -> list[dict[str, Any]]:
        return [_summary(r, f) for r, f in zip(self.responses, self.files, strict=True)]

    @cached_property
    def _pairs(self) -> list[dict[str, Any]]:
        return [asdict(pair) for pair in reciprocity(self.responses)]


def identify_response(
    robot_file: Path,
    folder: Path,
    out: Path,
    *,
    method: Average | Literal["local_polynomial"] = "arithmetic",
    command: str = "",
    progress: Progress = silent,
) -> IdentifiedResponses:
    """Reduce the joint logs in `folder` to response_pose_<p>.npz in `out`, one recording in memory at a time.

    `method` averages the realisations in one of the ways of `frequency_responses`, or is the local polynomial method. The plan goes with
    the responses: the fit of stage 1 needs its reference motion. results.json and report.html go there too.
    Raises `FlexcalError` where a log is missing, has gaps or does not fit the plan.
    """
    model = RobotModel.from_yaml(robot_file, estimates=False)
    cell = FolderCell(folder, model)
    plan = cell.plan
    if not isinstance(plan, MultisinePlan):
        what = "measured poses" if plan.kind == "poses" else "trajectories"
        verb = "calibrate" if plan.kind == "poses" else "identify inertials"
        raise InputError(
            "E-RUN-073", f"{folder} holds {what}, not a frequency experiment; give them to 'flexcal {verb}'."
        )
    total = len(plan.poses) * plan.recordings_per_pose
    names = [model.joint_names[i] for i in plan.joints]
    recordings = _counted(cell.record(), total, progress)
    if method == "local_polynomial":
        responses = tuple(local_polynomial_responses(plan, recordings, joint_names=names))
    else:
        responses = tuple(frequency_responses(plan, recordings, method, joint_names=names))
    files = tuple(out / f"response_pose_{response.pose + 1}.npz" for response in responses)
    for response, file in zip(responses, files, strict=True):
        response.save(file)
    write_plan(out / PLAN, plan)
    logs = [existing_file(folder, label.name) for label in labels(plan)]
    origin = provenance([robot_file, model.urdf, folder / PLAN, *logs], {"method": method})
    result = IdentifiedResponses(
        responses, files, model.name, RunRecord(origin, command), tuple(model.sensors)
    )
    from flexcal.jobs.pages import report_folder

    write_results(out, result.document())
    report_folder(out)
    return result


def _counted(recordings: Iterable[Recording], total: int, progress: Progress) -> Iterator[Recording]:
    progress("responses", 0.0)
    for number, recording in enumerate(recordings, start=1):
        yield recording
        progress("responses", number / total)


def _summary(response: FrequencyResponse, file: Path) -> dict[str, Any]:
    def relative(std: np.ndarray) -> float:
        return float(np.median(relative_to_diagonal(std, response.response)))

    return {
        "pose": response.pose + 1,
        "file": file,
        "joints": list(response.joints),
        "lines": len(response.frequencies_hz),
        "lowest_hz": float(response.frequencies_hz[0]),
        "highest_hz": float(response.frequencies_hz[-1]),
        "method": response.average,
        "degrees_of_freedom": response.degrees_of_freedom,
        "relative_std": relative(response.std),
        "relative_noise_std": relative(response.noise_std),
        "odd_distortion": response.odd_distortion,
        "sensors": {name: _sensor_std(response, row) for row, name in enumerate(response.sensors)},
    }


def _sensor_std(response: FrequencyResponse, row: int) -> float:
    """Relative standard deviation of a sensor's row of the response, at the median line."""
    at = len(response.joints) + row
    sizes = np.linalg.norm(response.stacked[:, at], axis=1)
    return float(np.median(np.linalg.norm(response.stacked_std[:, at], axis=1) / sizes))
