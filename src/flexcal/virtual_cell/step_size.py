"""Step size required to simulate the plant."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from flexcal.errors import FlexcalError
from flexcal.model.robot import ArmSensor, RobotModel
from flexcal.virtual_cell.config import CellConfig
from flexcal.virtual_cell.plant import Plant, build_plant, unresolved

REFINEMENTS = (1, 2, 4, 8)


def resolved_plant(
    truth: RobotModel,
    config: CellConfig,
    *,
    q: np.ndarray,
    free: Collection[int],
    payload: float | None,
    rate_hz: float,
    sensors: Sequence[ArmSensor] = (),
) -> tuple[Plant, int]:
    """The plant and its steps per tick: as many as configured, doubled until the true robot's fastest modes are resolved.

    Springs that the mismatch puts into a wrist too light for any refinement, as it is without a payload, are left out: their modes lie far
    above whatever moves the robot. Raises `FlexcalError` where no refinement resolves the others.
    """
    configs = [config]
    if config.mismatch.elastic_wrist > 0:
        configs.append(replace(config, mismatch=replace(config.mismatch, elastic_wrist=0.0)))
    phrase = ""
    for tried in configs:
        for refinement in REFINEMENTS:
            substeps = config.controller.substeps * refinement
            step = 1 / (rate_hz * substeps)
            try:
                with warnings.catch_warnings(action="error", category=UserWarning):
                    plant = build_plant(
                        truth, tried, q=q, free=free, payload=payload, time_step=step, sensors=sensors
                    )
                    missed = unresolved(plant)
            except (ValueError, UserWarning) as problem:  # MuJoCo's, and of a mass matrix that is singular
                raise FlexcalError(
                    "E-CELL-026",
                    f"the virtual robot of {truth.path} cannot be simulated ({' '.join(str(problem).split())}); correct its masses, "
                    "inertias and springs, there or in the truth.",
                ) from problem
            if missed is None:
                return plant, substeps
            phrase = f"plant steps of {step * 1e3:g} ms are too long for {missed}"
    raise FlexcalError(
        "E-CELL-027", f"{phrase}; raise the controller's substeps or rate, or friction's coulomb_velocity."
    )
