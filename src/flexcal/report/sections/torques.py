"""Torque prediction of the identified robot, over time and over frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

from flexcal.dynamics.diagnostics import TorquePrediction
from flexcal.report.figures import torque_spectra, torque_traces
from flexcal.report.layout import Block, FigureBlock, Selector, Table, significant


def recording_labels(predictions: Sequence[TorquePrediction]) -> tuple[str, ...]:
    """Labels of recordings: their numbers, from 1, and file names."""
    return tuple(f"{k}: {PurePath(log.name).name}" for k, log in enumerate(predictions, 1))


def torque_blocks(
    error: Mapping[str, Any],
    held_out: str,
    logs: Mapping[str, TorquePrediction],
    units: Mapping[str, str] | None = None,
) -> tuple[Block, ...]:
    """Errors by joint (results.json: error_percent) and, where there are `logs`, the torques themselves, by label.

    `held_out` says what the fit never saw, if anything; `units` are those of the joints (results.json: torque_units), N m without.
    """
    where = held_out or "the recordings of the fit"
    rows = [(joint, significant(value, 3)) for joint, value in error["per_joint"].items()]
    overall = error["held_out"] if held_out else error["train"]
    rows.append(("all joints", significant(overall, 3)))
    blocks: list[Block] = [
        Table(
            "table-torques",
            f"Relative torque error, {where}",
            ("joint", "relative error / % of the norm of its torques"),
            tuple(rows),
            strong=(len(rows) - 1,),
        )
    ]
    if logs:
        joints = {joint: (units or {}).get(joint, "N m") for joint in error["per_joint"]}
        choice = (Selector("recording", "log", tuple(logs)),) if len(logs) > 1 else ()
        blocks += [_traces(joints, logs, choice), _spectra(joints, logs, choice)]
    return tuple(blocks)


def _traces(
    joints: Mapping[str, str], logs: Mapping[str, TorquePrediction], choice: tuple[Selector, ...]
) -> FigureBlock:
    stride = max(log.stride for log in logs.values())
    thinned = f" Of a long recording only one row in up to {stride} is drawn." if stride > 1 else ""
    unseen = any(log.held_out.any() for log in logs.values())
    red = ", red outside the fit" if unseen else ""
    return FigureBlock(
        "figure-torques",
        "Torques over time",
        torque_traces(joints, logs),
        "Grey is the motor torque as measured, at the joint; blue is predicted in the part that was fitted"
        f"{red}. Standstill is drawn too, though it was not fitted.{thinned}",
        f"Measured and predicted torque of {len(joints)} joints against time.",
        choice,
    )


def _spectra(
    joints: Mapping[str, str], logs: Mapping[str, TorquePrediction], choice: tuple[Selector, ...]
) -> FigureBlock:
    return FigureBlock(
        "figure-spectra",
        "Spectrum of the residual torque",
        torque_spectra(joints, logs),
        "A flat red spectrum is noise. Where it follows the grey one, the model lacks a term: at low frequencies mostly friction, at a "
        "single peak a resonance or gear ripple. All rows count, including standstill and rows outside the fit.",
        f"Amplitude densities of measured torque and residual of {len(joints)} joints.",
        choice,
    )
