"""Filtering and decimation of a log: as declared in robot.yaml, else proposed from the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexcal.data.recordings import Decimation
from flexcal.dynamics.regression import ContinuousSamples, CutoffChoice, choose_cutoff, pieces
from flexcal.dynamics.signals import JointLog, MotionBandwidth, log_blocks, motion_bandwidth
from flexcal.errors import InputError
from flexcal.jobs.logs.worker_files import worker_paths
from flexcal.model.robot import RobotModel
from flexcal.parallel import ThisProcess, Workers

_PASSED = 20.0
"""Ratio of cut-off and row rate to the bandwidth of the motion: ten times twice of it, since products of two velocities have twice its
bandwidth.
"""
_HIGHEST = 0.4
"""Largest ratio of cut-off to sampling rate."""
_REVERSALS = 0.1
"""Least ratio of cut-off to sampling rate if springs are identified."""
_ROWS = 4.0
"""Rows per second, relative to a cut-off chosen by cross-validation: twice the passed bandwidth."""
_HERE = ThisProcess()
_SAMPLES = 40_000
"""Largest number of samples, over all logs, used by cross-validation."""


@dataclass(frozen=True)
class Preprocessing:
    """Low-pass of the positions, decimation, and whether standstill is masked; `proposed` names what robot.yaml lacks.

    `choice` is that of a cut-off by cross-validation, None where the spectrum alone tells it.
    """

    cutoff_hz: float
    decimation: Decimation
    mask_standstill: bool
    proposed: tuple[str, ...] = ()
    choice: CutoffChoice | None = None


def choose_preprocessing(
    model: RobotModel,
    logs: Sequence[Path],
    *,
    flexible: bool = False,
    loaded: Sequence[bool] | None = None,
    workers: Workers = _HERE,
) -> Preprocessing:
    """Preprocessing as declared, or proposed from the fastest motion and the lowest sampling rate of `logs`.

    The cut-off is ten times the bandwidth (Gautier 1997), which is twice that of the velocities, unless a lower one predicts the torques of
    left-out blocks better (`choose_cutoff`); logs differ in load where `loaded` or their column says so. For `flexible` drives it is a
    tenth of the sampling rate, where that is more: a low-pass sees the motor reverse late, as its Coulomb friction brakes it before and
    after, and what friction then lacks looks like more stiffness. Raises `InputError` where a log that is needed for it shows no motion.
    """
    declared = model.config.dynamics
    if declared.cutoff_hz is not None and declared.decimation is not None:
        return Preprocessing(declared.cutoff_hz, Decimation(declared.decimation), declared.mask_standstill)
    there = worker_paths(logs, workers)
    bandwidths = list(workers.values(_bandwidth, there, model))
    for log, motion in zip(logs, bandwidths, strict=True):
        if motion.frequency_hz == 0:
            raise InputError(
                "E-RUN-062",
                f"{log}: the positions show no motion above their noise; record a motion that excites all joints.",
            )
    rate = min(motion.rate_hz for motion in bandwidths)
    cutoff_hz = rows_hz = min(_PASSED * max(motion.frequency_hz for motion in bandwidths), _HIGHEST * rate)
    choice = None
    if flexible:
        cutoff_hz = max(cutoff_hz, _REVERSALS * rate)
    elif declared.cutoff_hz is None:
        choice = _chosen(model, there, cutoff_hz, loaded, workers)
        if choice is not None:
            cutoff_hz, rows_hz = choice.cutoff_hz, min(rows_hz, _ROWS * choice.cutoff_hz)
    proposed = tuple(key for key in ("cutoff_hz", "decimation") if getattr(declared, key) is None)
    return Preprocessing(
        float(f"{cutoff_hz:.2g}") if declared.cutoff_hz is None else declared.cutoff_hz,
        Decimation.near(rate / rows_hz) if declared.decimation is None else Decimation(declared.decimation),
        declared.mask_standstill,
        proposed,
        choice,
    )


def _chosen(
    model: RobotModel,
    logs: Sequence[Path],
    proposed_hz: float,
    loaded: Sequence[bool] | None,
    workers: Workers,
) -> CutoffChoice | None:
    """Preprocessing chosen by cross-validation within the logs of each load."""
    loads: dict[tuple[bool, float | None], list[ContinuousSamples]] = {}
    each = workers.values(_pieces, logs, model, _SAMPLES // len(logs), proposed_hz)
    for number, own in enumerate(each):
        for piece in own:
            load = (bool(loaded and loaded[number]), piece.payload)
            loads.setdefault(load, []).append(piece)
    return choose_cutoff(model, list(loads.values()), proposed_hz)


def _bandwidth(log: Path, model: RobotModel) -> MotionBandwidth:
    return motion_bandwidth(log_blocks(log, model))


def _pieces(log: Path, model: RobotModel, samples: int, proposed_hz: float) -> list[ContinuousSamples]:
    return list(pieces(log_blocks(log, model), samples, proposed_hz))


def preprocessing_document(preprocessing: Preprocessing, logs: Sequence[JointLog]) -> dict[str, Any]:
    """Entry `signals` of results.json: filters, and the treatment of nonuniform time stamps of each log."""
    return {
        "cutoff_hz": preprocessing.cutoff_hz,
        "decimation": preprocessing.decimation.factor,
        "proposed": list(preprocessing.proposed),
        "cross_validation": None
        if preprocessing.choice is None
        else {
            "error_percent": 100 * preprocessing.choice.error,
            "error_of_spectrum_percent": 100 * preprocessing.choice.proposed_error,
        },
        "time_stamps": {str(log.path): log.time_stamps for log in logs if log.time_stamps},
    }


def preprocessing_remarks(signals: Mapping[str, Any]) -> list[str]:
    """Remarks on proposed filters, with the reason, and on the treatment of time stamps."""
    said = []
    if signals["proposed"]:
        tried = signals["cross_validation"]
        source = "the spectrum of the motion" if tried is None else "the torques of left-out blocks"
        said.append(
            f"proposed from {source}, because robot.yaml lacks {' and '.join(signals['proposed'])}: "
            f"'dynamics: {{cutoff_hz: {signals['cutoff_hz']:g}, decimation: {signals['decimation']}}}'"
        )
        if tried is not None:
            said.append(
                f"with ten times the bandwidth of the positions as cut-off, which noise increases, the error in left-out blocks would be "
                f"{tried['error_of_spectrum_percent']:.1f} % instead of {tried['error_percent']:.1f} %"
            )
    return said + [f"{log}: {words}" for log, words in signals["time_stamps"].items()]
