"""Files of points and arm drawings of calibrate and verify: points.csv and arm.npz."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flexcal.calibration.diagnostics import GravityLoads
from flexcal.calibration.verification import (
    CALIBRATED,
    DECLARED,
    NOMINAL,
    OWN,
    RIGID,
    ArmPoses,
    MeasuredPoints,
)
from flexcal.data.poses import PoseSet
from flexcal.data.tables import LARGEST_TABLE
from flexcal.errors import InputError, unreadable
from flexcal.files.formats import ArrayForm, NpzFile, write_npz
from flexcal.files.transaction import atomic_path, current_path, read_bytes
from flexcal.jobs.result_files.document import AGAIN
from flexcal.units import LARGEST

if TYPE_CHECKING:
    import polars as pl

POINTS, ARM, LOADS = "points.csv", "arm.npz", "gravity_loads.npz"
_MODELS = (DECLARED, NOMINAL, OWN, RIGID, CALIBRATED)
_TEXTS = ("target", "station", "socket", "holder")


def write_points(folder: Path, points: MeasuredPoints) -> None:
    """Write `points` to points.csv in `folder`, atomically; rad and m."""
    import polars as pl

    poses = points.poses
    columns: dict[str, np.ndarray] = {"pose": poses.pose, "target": poses.target, "station": poses.station}
    if poses.socket is not None and poses.holder is not None:
        columns |= {"socket": poses.socket, "holder": poses.holder}
    columns |= {f"q{i + 1}": poses.q[:, i] for i in range(poses.q.shape[1])}
    columns |= _vectors("", poses.position)
    if poses.sigma_given:
        columns |= _vectors("sigma_", poses.sigma)
    for name in ("payload", "temperature"):
        values = getattr(poses, name)
        if values is not None:
            columns[name] = values
    if poses.time is not None:
        columns["t"] = poses.time
    for model, errors in points.errors.items():
        columns |= _vectors(f"{model}_d", errors)
    if points.parameter_rms is not None:
        columns["parameter_rms"] = points.parameter_rms
    if points.scatter_rms is not None:
        columns["scatter_rms"] = points.scatter_rms
    columns["ambiguous"] = points.ambiguous
    with atomic_path(folder / POINTS) as temporary, temporary.open("wb") as stream:
        pl.DataFrame(columns).write_csv(stream)


def read_points(folder: Path, *, sigma: float) -> MeasuredPoints:
    """Points from a file of `write_points`; `sigma` (m) is that of each coordinate if the file gives none.

    Raises `InputError` where the file is not there or not such a one.
    """
    import polars as pl

    path = folder / POINTS
    try:
        table = pl.read_csv(
            read_bytes(path, limit=LARGEST_TABLE), schema_overrides=dict.fromkeys(_TEXTS, pl.String)
        )
        joints = [name for name in table.columns if name.startswith("q") and name[1:].isdigit()]

        def vectors(prefix: str) -> np.ndarray:
            return _numbers(path, table.select([f"{prefix}{axis}" for axis in "xyz"]))

        def column(name: str) -> np.ndarray | None:
            return _numbers(path, table.select(name))[:, 0] if name in table.columns else None

        def texts(name: str) -> np.ndarray | None:
            return table[name].fill_null("").to_numpy() if name in table.columns else None

        given = "sigma_x" in table.columns
        poses = PoseSet(
            q=_numbers(path, table.select(joints)),
            position=vectors(""),
            sigma=vectors("sigma_") if given else np.full((len(table), 3), sigma),
            torque=None,
            payload=column("payload"),
            target=table["target"].to_numpy(),
            station=table["station"].to_numpy(),
            temperature=column("temperature"),
            time=column("t"),
            socket=texts("socket"),
            holder=texts("holder"),
            pose=table["pose"].to_numpy(),
            sigma_given=given,
        )
        errors = {model: vectors(f"{model}_d") for model in _MODELS if f"{model}_dx" in table.columns}
        ambiguous = table["ambiguous"].cast(pl.Boolean).to_numpy()
        if CALIBRATED not in errors or not joints or not len(table):
            raise InputError("E-RUN-081", f"{path} lacks columns or rows; {AGAIN}.")
        return MeasuredPoints(poses, errors, ambiguous, column("parameter_rms"), column("scatter_rms"))
    except (pl.exceptions.PolarsError, OSError) as problem:
        raise unreadable(path, problem, AGAIN) from problem


def _numbers(path: Path, columns: pl.DataFrame) -> np.ndarray:
    import polars as pl

    values = columns.cast(pl.Float64).to_numpy()
    if (np.abs(values) > LARGEST).any():
        raise InputError(
            "E-RUN-082",
            f"{path} holds {values[np.abs(values) > LARGEST][0]:g}, which is no measurement; {AGAIN}.",
        )
    return values


def write_arm(folder: Path, arms: ArmPoses) -> None:
    """Write `arms` to arm.npz in `folder`, atomically."""
    arrays = {
        "corners": arms.corners,
        "surface": arms.surface,
        "triangles": arms.triangles,
        "pose": arms.pose,
        "tip": arms.tip,
    }
    arrays |= {f"errors_{model}": errors for model, errors in arms.errors.items()}
    write_npz(folder / ARM, arrays)


def read_arm(folder: Path) -> ArmPoses:
    """Arm drawings from a file of `write_arm`; raises `InputError` if it is missing or invalid."""
    file = NpzFile(folder / ARM, AGAIN)
    forms = {
        "corners": ArrayForm("real", ("drawn", "corners", 3)),
        "surface": ArrayForm("real", ("in full", "vertices", 3)),
        "triangles": ArrayForm("whole", ("triangles", 3)),
        "pose": ArrayForm("whole", ("points",)),
        "tip": ArrayForm("real", ("points", 3)),
    }
    arrays = file.read(
        forms | {name: ArrayForm("real", ("points", 3)) for name in _of_models(file, "errors_")}
    )
    triangles = arrays["triangles"]
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < arrays["surface"].shape[1]:
        raise file.error("E-RUN-083", "holds triangles of vertices that are not there")
    errors = {name.removeprefix("errors_"): arrays.pop(name) for name in _of_models(file, "errors_")}
    return ArmPoses(**arrays, errors=errors)


def write_loads(folder: Path, loads: GravityLoads) -> None:
    """Write `loads` to gravity_loads.npz in `folder`, atomically."""
    arrays = {"torque": loads.torque} | {f"along_{model}": along for model, along in loads.along.items()}
    write_npz(folder / LOADS, arrays)


def read_loads(folder: Path) -> GravityLoads | None:
    """Gravity loads from a file of `write_loads`, None without it, as in folders of an older flexcal; raises `InputError` if unreadable."""
    path = folder / LOADS
    if not current_path(path).is_file():
        return None
    file = NpzFile(path, AGAIN)
    loads = ArrayForm("real", ("points", "joints"))
    arrays = file.read({name: loads for name in ("torque", *_of_models(file, "along_"))})
    return GravityLoads(
        arrays.pop("torque"), {name.removeprefix("along_"): along for name, along in arrays.items()}
    )


def _of_models(file: NpzFile, prefix: str) -> list[str]:
    return [f"{prefix}{model}" for model in _MODELS if f"{prefix}{model}" in file]


def _vectors(prefix: str, values: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{prefix}{axis}": values[:, k] for k, axis in enumerate("xyz")}
