"""Measured and predicted points of a verification as a table, written and read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.verification import CALIBRATED, NOMINAL, OWN, RIGID, MeasuredPoints
from flexcal.data.poses import PoseSet
from flexcal.data.tables import LARGEST_TABLE
from flexcal.errors import unreadable
from flexcal.files.transaction import atomic_path, read_bytes
from flexcal.jobs.result_files.document import AGAIN

if TYPE_CHECKING:
    from flexcal.jobs.two_stage import TwoStageRun

VERIFICATION = "verification.csv"


_COLUMNS = {NOMINAL: "nominal", OWN: "own", CALIBRATED: "elastic", RIGID: "rigid"}
"""Models of verification.csv, and the names of their columns there."""


def write_verification(path: Path, run: TwoStageRun) -> None:
    """Write verification.csv, atomically; rad and m: pose, q1…, x, y, z (noise-free truth), the tracker's reading with 1σ, the
    prediction of every model, the distance expected from the covariance of the elastic model's parameters, and whether the flanks are
    certain.
    """
    import polars as pl

    poses, elastic = run.verification_poses, run.elastic_verification
    before = {NOMINAL: run.nominal_verification, OWN: run.own_verification}
    models = before | {CALIBRATED: elastic, RIGID: run.rigid_verification[0]}
    columns: dict[str, np.ndarray] = {"pose": poses.pose}
    columns |= {f"q{i + 1}": poses.q[:, i] for i in range(poses.q.shape[1])}
    columns |= {axis: poses.position[:, k] for k, axis in enumerate("xyz")}
    measured = run.measured_verification.position + run.measured_verification.errors
    columns |= {f"measured_{axis}": measured[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"sigma_{axis}": poses.sigma[:, k] for k, axis in enumerate("xyz")}
    for model, verification in models.items():
        columns |= {f"{_COLUMNS[model]}_{axis}": verification.position[:, k] for k, axis in enumerate("xyz")}
    columns |= {"parameter_rms": elastic.parameter_rms, "scatter_rms": run.measured_verification.scatter_rms}
    columns |= {"model_rms": elastic.scatter_rms}
    columns["unambiguous"] = ~elastic.ambiguous
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        pl.DataFrame(columns).write_csv(stream)


def read_verification(path: Path) -> tuple[MeasuredPoints, MeasuredPoints]:
    """Verification poses from a file of `write_verification`, as measured and in truth; raises `InputError` if unreadable."""
    import polars as pl

    try:
        table = pl.read_csv(read_bytes(path, limit=LARGEST_TABLE))

        def vectors(prefix: str) -> np.ndarray:
            return table.select([f"{prefix}{axis}" for axis in "xyz"]).cast(pl.Float64).to_numpy()

        predicted = {m: vectors(f"{name}_") for m, name in _COLUMNS.items() if f"{name}_x" in table.columns}
        size, certain = len(table), table["unambiguous"].cast(pl.Boolean).to_numpy()
        q = table.select([name for name in table.columns if name[0] == "q"]).cast(pl.Float64).to_numpy()

        def points(position: np.ndarray, sigma: np.ndarray, scatter: str) -> MeasuredPoints:
            poses = PoseSet(
                q=q,
                position=position,
                sigma=sigma,
                torque=None,
                payload=None,
                target=np.full(size, ""),
                station=np.full(size, ""),
                temperature=None,
                pose=table["pose"].to_numpy(),
            )
            errors = {model: position - where for model, where in predicted.items()}
            rms = (table[name].cast(pl.Float64).to_numpy() for name in ("parameter_rms", scatter))
            return MeasuredPoints(poses, errors, ~certain, *rms)

        measured = points(vectors("measured_"), vectors("sigma_"), "scatter_rms")
        return measured, points(vectors(""), np.zeros((size, 3)), "model_rms")
    except (pl.exceptions.PolarsError, TypeError, OSError) as problem:
        raise unreadable(path, problem, AGAIN) from problem
