"""Learned residual torque of identified dynamics: reduction of the error, block of results.json, and file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexcal.dynamics.estimators import RecordedRows
from flexcal.dynamics.regression import ExperimentSystem
from flexcal.dynamics.residual import (
    LEARNED,
    CrossValidatedErrors,
    LearnedResidual,
    LearnedTorqueErrors,
    learn_residual,
    require_residual_path,
    residual_errors,
    write_learned_residual,
)
from flexcal.estimation import Estimate
from flexcal.progress import Progress


@dataclass(frozen=True, eq=False)
class LearnedDynamics:
    """Learned residual torques, and torque errors with and without them: in left-out blocks, in all of the fit, and held out."""

    learned: LearnedResidual
    blocks: CrossValidatedErrors
    train: LearnedTorqueErrors
    held_out: LearnedTorqueErrors | None

    @classmethod
    def of(
        cls,
        recorded: RecordedRows,
        systems: list[ExperimentSystem],
        unseen: RecordedRows | None,
        estimate: Estimate,
        progress: Progress,
    ) -> LearnedDynamics:
        """Residual learned from `recorded` alone, with the equations `systems`; raises `FlexcalError` as `learn_residual` does."""
        learned, blocks = learn_residual(recorded, systems, estimate, progress)
        values = estimate.parameters.coordinates()
        held_out = None if unseen is None else residual_errors(learned, unseen, values)
        return cls(learned, blocks, residual_errors(learned, recorded, values), held_out)

    @staticmethod
    def require_place(estimates: Path) -> None:
        """Raise `InputError` if another program's file stands at the output path, beside the file `estimates`."""
        require_residual_path(estimates.with_name(LEARNED))

    def file(self, estimates: Path) -> Path | None:
        """Output path beside the file `estimates`; None if nothing was learned."""
        return estimates.with_name(LEARNED) if self.learned.learned else None

    def store(self, estimates: Path) -> None:
        """Write the learned residual, for the block `dynamics` of the file `estimates`."""
        if file := self.file(estimates):
            write_learned_residual(file, self.learned, estimates)

    def document(self, estimates: Path) -> dict[str, Any]:
        """Block of results.json."""
        errors = self.blocks
        motors = zip(self.learned.motors, errors.measured, errors.physical, errors.together, strict=True)
        return {
            "motors": [
                {
                    "motor": motor.name,
                    "learned": motor.learned,
                    "cross_validation_percent": _percent(np.array([physical, together]) / measured),
                }
                for motor, measured, physical, together in motors
            ],
            "error_percent": {
                "cross_validation": _percent(self.blocks.overall),
                "train": _percent(self.train.overall),
                "held_out": None if self.held_out is None else _percent(self.held_out.overall),
            },
            "per_joint": self._per_joint(),
            "file": self.file(estimates),
        }

    def _per_joint(self) -> dict[str, dict[str, Any]]:
        """Errors per joint, of the held-out part if there is one."""
        shown = self.train if self.held_out is None else self.held_out
        rows = zip(shown.measured, shown.physical, shown.together, shown.inside, strict=True)
        return {
            motor.name: _percent(np.array([physical, together]) / measured)
            | {"inside_interval_percent": 100 * float(inside)}
            for motor, (measured, physical, together, inside) in zip(self.learned.motors, rows, strict=True)
        }


def _percent(errors: tuple[float, float] | np.ndarray) -> dict[str, float]:
    without, together = (100 * float(error) for error in errors)
    return {"without": without, "with": together}
