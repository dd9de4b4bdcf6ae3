"""Bias of flexible drives by rounded positions, from what more noise of the same kind does (SIMEX; Cook & Stefanski 1994)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from flexcal.data.recordings import Recording, read_recording_blocks
from flexcal.estimation import Estimate
from flexcal.files.transaction import FileTransaction
from flexcal.jobs.logs import log_files, scratch_folder
from flexcal.model.robot import RobotModel

_DRAWS = 4
_DOUBT = 0.5
"""Share of the bias that stays uncertain: the extrapolation is linear, and the error of rounding is neither white nor independent."""
_SIGNIFICANT = 0.1
"""Least bias, in standard deviations, that is removed."""
_EXACT = 1e-3
"""Largest distance of a change from a whole number of steps, in steps, and largest share of changes that are farther."""
_SIDES = ("q", "arm", "tilt_x", "tilt_y")


@dataclass(frozen=True)
class EncoderBias:
    """Largest rounding `step` of the positions (rad, or m), and the relative bias by name of the stiffnesses that were corrected."""

    step: float
    stiffness: Mapping[str, float]

    def remarks(self) -> Iterator[str]:
        """What was corrected, a sentence a stiffness."""
        for name, share in self.stiffness.items():
            yield (
                f"positions are rounded to {self.step:.2g} rad, which had {'reduced' if share < 0 else 'increased'} {name} by "
                f"{100 * abs(share):.2g} %; this is corrected, and its interval includes half of it; finer encoders help"
            )


def without_encoder_bias(
    model: RobotModel,
    logs: Sequence[Path],
    estimate: Estimate,
    refit: Callable[[RobotModel, Sequence[Path], Path], Estimate],
) -> tuple[Estimate, EncoderBias | None]:
    """Estimate from logs whose positions on both sides of the drives are rounded, less the bias that the rounding causes.

    As much white noise as the rounding causes, Δ²/12, is added to the positions, and the mean change of the parameters over four such
    fits is the bias; half of it remains in the covariance. `refit` fits a robot to files in SI units, with a folder for intermediate
    files. None, and the estimate as it is, where positions are not rounded, a log has gaps or more than a million rows, or more noise
    changes what is identifiable.
    """
    parts = [list(islice(read_recording_blocks(log, model), 2)) for log in logs]
    whole = [recordings[0] for recordings in parts if len(recordings) == 1]
    steps = [{side: _steps(recording, side) for side in _SIDES} for recording in whole]
    elastic = [joint.index for joint in model.driven]
    rounded = all(np.all(one[side][elastic] > 0) for one in steps for side in ("q", "arm"))
    if len(whole) < len(parts) or not rounded:
        return estimate, None
    rng = np.random.default_rng(0)
    plain = replace(model, config=replace(model.config, signals={}))
    moved = []
    for _ in range(_DRAWS):
        with scratch_folder() as folder:
            with FileTransaction():  # they take their places now, not with the results
                copies = log_files(list(map(partial(_noisy, rng), whole, steps)), folder, "noisy")
            again = refit(plain, copies, folder)
        if again.identifiable != estimate.identifiable:
            return estimate, None
        moved.append(again.parameters.coordinates() - estimate.parameters.coordinates())
    bias = np.mean(moved, axis=0)
    spread = np.sqrt(np.diag(estimate.covariance))
    largest = max(float(values.max(initial=0.0)) for one in steps for values in one.values())
    if np.all(np.abs(bias) <= _SIGNIFICANT * spread):
        return estimate, EncoderBias(largest, {})
    scatter = np.cov(moved, rowvar=False) / _DRAWS
    corrected = replace(
        estimate,
        parameters=estimate.parameters.with_coordinates(estimate.parameters.coordinates() - bias),
        covariance=estimate.covariance + scatter + np.outer(_DOUBT * bias, _DOUBT * bias),
    )
    shares = {
        name: estimate.values[name] / corrected.values[name] - 1
        for k, name in enumerate(estimate.parameters.names)
        if name.endswith(".stiffness") and abs(bias[k]) > _SIGNIFICANT * spread[k]
    }
    return corrected, EncoderBias(largest, shares)


def _steps(recording: Recording, side: str) -> np.ndarray:
    """Rounding step (n,) of the positions of every joint; zero where they are not whole numbers of one."""
    positions = getattr(recording, side)
    return np.zeros(0) if positions is None else np.array([_step(values) for values in positions.T])


def _step(values: np.ndarray) -> float:
    changes = np.abs(np.diff(values))
    changes = changes[changes > np.spacing(np.abs(values).max()) * 8]
    if not len(changes):
        return 0.0
    step = float(changes.min())
    step = float(np.median(changes[changes < 1.5 * step]))  # without the last bits
    multiples = changes / step
    return step if np.mean(np.abs(multiples - np.rint(multiples)) > _EXACT * multiples) <= _EXACT else 0.0


def _noisy(rng: np.random.Generator, recording: Recording, steps: Mapping[str, np.ndarray]) -> Recording:
    sides = {side: getattr(recording, side) for side in _SIDES if len(steps[side])}
    noisy = {side: at + steps[side] * rng.uniform(-0.5, 0.5, at.shape) for side, at in sides.items()}
    return replace(recording, **noisy)
