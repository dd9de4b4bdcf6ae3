"""How finely the plant has to be stepped."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from flexcal.cell.config import CellConfig
from flexcal.cell.plant import Plant, build_plant, unresolved
from flexcal.errors import FlexcalError
from flexcal.model import RobotModel

REFINEMENTS = (1, 2, 4, 8)


def resolved_plant(
    truth: RobotModel,
    config: CellConfig,
    *,
    q: np.ndarray,
    free: Collection[int],
    payload: float | None,
    rate_hz: float,
) -> tuple[Plant, int]:
    """The plant and its steps per tick: as many as configured, doubled until the true robot's fastest modes are resolved.

    Raises `FlexcalError` where no refinement resolves them.
    """
    phrase = ""
    for refinement in REFINEMENTS:
        substeps = config.controller.substeps * refinement
        step = 1 / (rate_hz * substeps)
        plant = build_plant(truth, config, q=q, free=free, payload=payload, time_step=step)
        missed = unresolved(plant)
        if missed is None:
            return plant, substeps
        phrase = f"plant steps of {step * 1e3:g} ms are too long for {missed}"
    raise FlexcalError(f"{phrase}; raise the controller's substeps or rate, or friction's coulomb_velocity.")
