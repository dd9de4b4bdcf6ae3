"""Identification of a payload from a robot.yaml and files, and estimates.yaml."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.formats import provenance, read_estimates
from flexcal.jobs.inputs import stored_estimates
from flexcal.jobs.payload.identification import attach_payload, identify_payload
from flexcal.jobs.payload.planned_recordings import PlannedLogs, with_planned_torque
from flexcal.jobs.payload.result import PayloadIdentification
from flexcal.jobs.result_files import RunRecord, estimates_target
from flexcal.model.robot import PAYLOAD_FRAME, RobotModel, with_blocks
from flexcal.progress import Progress, silent


def identify_robot_payload(
    robot_file: Path,
    logs: Sequence[Path],
    *,
    free: Sequence[Path] = (),
    frame: str = "",
    estimates: Path | None = None,
    accept_weight: bool = False,
    out: Path | None = None,
    command: str = "",
    jobs: int = 1,
    progress: Progress = silent,
) -> PayloadIdentification:
    """`identify_payload` of the robot of a robot.yaml, and storing of the block `payload`.

    `logs` and `free` are files, or folders of trajectories as 'measure' leaves them. The robot has its estimates of all blocks but that
    of the payload. `estimates` is read (and written) in place of those beside robot.yaml: a file, or the folder that another
    identification wrote. With `out`, estimates, results.json, predictions.npz and report.html go to that folder. Raises `FlexcalError` as
    `identify_payload` does; nothing is written then.
    """
    loaded, unloaded = PlannedLogs.of(logs), PlannedLogs.of(free)
    _require_plans(loaded, unloaded)
    nominal = with_planned_torque(
        RobotModel.from_yaml(robot_file, estimates=False), [*loaded.plans, *unloaded.plans]
    )
    bare, frame = attach_payload(nominal, frame)
    source = stored_estimates(bare, estimates)
    if estimates is not None and not source.exists():
        raise InputError(
            "E-RUN-063", f"{source} does not exist; give the estimates.yaml of 'flexcal identify dynamics'."
        )
    blocks = read_estimates(source, without="payload") if source.exists() else {}
    target = estimates_target(bare, out, "payload", None if estimates is None else source)
    if "dynamics" not in blocks and not free:
        raise InputError(
            "E-RUN-064",
            f"{source} has no block 'dynamics', so payload and robot inertia are not identifiable separately; run 'flexcal identify "
            f"dynamics {robot_file} "
            "LOGS…' on recordings without payload first, give its folder with --estimates, or such recordings with --free.",
        )
    identified = identify_payload(
        with_blocks(bare, blocks, source),
        loaded.files,
        dynamics=blocks.get("dynamics"),
        free=unloaded.files,
        frame=frame,
        accept_weight=accept_weight,
        jobs=jobs,
        progress=progress,
    )
    origin = provenance(
        [robot_file, bare.urdf, *loaded.plan_files, *unloaded.plan_files, *loaded.files, *unloaded.files],
        {"loaded": len(loaded.files), "free": len(unloaded.files)},
        source if blocks else None,
        tuple(blocks),
    )
    origin |= {PAYLOAD_FRAME: frame}
    result = replace(
        identified,
        estimate=replace(identified.estimate, provenance=origin),
        declared=nominal,
        blocks=blocks,
        estimates=target,
        record=RunRecord(origin, command),
    )
    result.store(source, out, blocks)
    return result


def _require_plans(loaded: PlannedLogs, free: PlannedLogs) -> None:
    """Raise `InputError` for trajectories recorded by another plan than the given one."""
    if any(plan.payload == 0 for plan in loaded.plans):
        raise InputError(
            "E-RUN-068",
            "a folder among LOGS was planned without the payload; give it with --free, or design it with --loaded.",
        )
    if any(plan.payload != 0 for plan in free.plans):
        raise InputError(
            "E-RUN-069", "a folder under --free was planned with the payload; give it among LOGS."
        )
