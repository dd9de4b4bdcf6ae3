"""Recordings to the overdetermined system W χ + ρ = Y (Eq. 2.26), one triangle a joint and experiment."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flexcal.data.filtering import Decimation
from flexcal.dynamics.base_parameters import BaseParameters
from flexcal.dynamics.motion import Motion
from flexcal.dynamics.observation import Observation
from flexcal.dynamics.triangle import Triangle
from flexcal.errors import FlexcalError

_BLOCK = 8192
"""Samples that are worked on at once."""
_STANDSTILL = 0.01
"""A joint stands still below this share of its largest speed in the recording."""


@dataclass(frozen=True, eq=False)
class Subsystem:
    """The equations of one joint in one experiment; `members` are the numbers of its columns among all."""

    joint: int
    experiment: int
    members: np.ndarray
    triangle: Triangle


@dataclass(frozen=True, eq=False)
class RegressionData:
    """Everything that a linear estimator needs; `masked` are the rows left out because the robot stood still."""

    observation: Observation
    base: BaseParameters
    subsystems: tuple[Subsystem, ...]
    masked: int

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        return self.observation.names

    def errors(self, parameters: np.ndarray) -> tuple[float, np.ndarray]:
        """‖Y − W χ‖ / ‖Y‖ for `parameters` (p,): of all joints stacked, and of each (n,)."""
        n = self.observation.model.n
        missed, size = np.zeros(n), np.zeros(n)
        for s in self.subsystems:
            missed[s.joint] += s.triangle.residual(parameters[s.members]) ** 2
            size[s.joint] += np.sum(s.triangle.right**2)
        return math.sqrt(missed.sum() / size.sum()), np.sqrt(missed / size)


@dataclass(frozen=True)
class Window:
    """Rows from `start` to before `end`, s on the recording's clock."""

    start: float = -math.inf
    end: float = math.inf


def observe(
    observation: Observation,
    base: BaseParameters,
    motions: Sequence[Motion],
    decimation: Decimation,
    *,
    mask_standstill: bool = True,
    windows: Sequence[Window] | None = None,
) -> RegressionData:
    """The system of several experiments: torques and every column through the same decimation, block by block.

    `windows` (one an experiment) restrict the rows that are kept. With `mask_standstill` rows at which all joints stand still are left
    out. Raises `FlexcalError` where no row is left, or a column comes out as not finite.
    """
    subsystems: list[Subsystem] = []
    masked = 0
    for experiment, motion in enumerate(motions):
        window = Window() if windows is None else windows[experiment]
        triangles = [Triangle.empty(len(members)) for members in observation.members]
        for block in _blocks(motion, decimation):
            time = decimation.apply(block.time[None])[0]
            keep = (time >= window.start) & (time < window.end)
            if mask_standstill:
                still = _still(block, motion, decimation)
                masked += int(np.sum(keep & still))
                keep &= ~still
            if not keep.any():
                continue
            torque = decimation.apply(block.torque.T)[:, keep]
            for joint, columns in enumerate(observation.columns(block)):
                rows = decimation.apply(columns)[:, keep].T
                if not (np.isfinite(rows).all() and np.isfinite(torque[joint]).all()):
                    raise FlexcalError(
                        f"the equations of joint {joint + 1} in experiment {experiment + 1} are not finite."
                    )
                triangles[joint] = triangles[joint] + Triangle.of(rows, torque[joint])
        if triangles[0].rows == 0:
            raise FlexcalError(
                f"no equation is left of experiment {experiment + 1}: it is too short for its filters, or the robot stands still in it."
            )
        subsystems += [
            Subsystem(joint, experiment, members, triangle)
            for joint, (members, triangle) in enumerate(zip(observation.members, triangles, strict=True))
        ]
    return RegressionData(observation, base, tuple(subsystems), masked)


def _blocks(motion: Motion, decimation: Decimation) -> Iterator[Motion]:
    """Parts that overlap by what the filter needs, so that their decimated rows follow each other as those of the whole."""
    rows = max(1, _BLOCK // decimation.factor)
    step = rows * decimation.factor
    for start in range(0, len(motion) - 2 * decimation.support, step):
        yield motion.part(start, min(start + step + 2 * decimation.support, len(motion)))


def _still(block: Motion, motion: Motion, decimation: Decimation) -> np.ndarray:
    limit = _STANDSTILL * np.abs(motion.dq).max(axis=0)
    moving = (np.abs(block.dq) > limit).any(axis=1)
    kept = moving[decimation.support : len(block) - decimation.support]
    return ~kept[:: decimation.factor]
