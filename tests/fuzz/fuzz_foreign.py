"""Measurements of the arm in the formats of other programs: Excel, MAT-files, Parquet, universal files and ROS recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl


def write_foreign(folder: Path, columns: dict[str, np.ndarray], log: dict[str, np.ndarray]) -> None:
    """`columns` of measured poses and of a `log`, where the packages for a format are there, as files named measured, recorded."""
    pl.DataFrame(columns).write_parquet(folder / "measured.parquet")
    _write_mat(folder, columns)
    _write_excel(folder, columns)
    _write_bags(folder, log)


def _write_mat(folder: Path, columns: dict[str, np.ndarray]) -> None:
    from scipy.io import savemat

    savemat(folder / "measured.mat", {"data": columns})
    try:
        import h5py
    except ImportError:
        return
    with h5py.File(folder / "measured_hdf5.mat", "w") as file:
        for name, values in columns.items():
            file[name] = values


def _write_excel(folder: Path, columns: dict[str, np.ndarray]) -> None:
    try:
        import openpyxl
    except ImportError:
        return
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(list(columns))
    for row in zip(*columns.values(), strict=True):
        sheet.append([float(value) for value in row])
    book.save(folder / "measured.xlsx")


def _write_bags(folder: Path, log: dict[str, np.ndarray]) -> None:
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        return
    store = get_typestore(Stores.ROS2_HUMBLE)
    types, kind = store.types, "sensor_msgs/msg/JointState"
    for plugin, ending in ((StoragePlugin.MCAP, "mcap"), (StoragePlugin.SQLITE3, "db3")):
        bag = folder / f"bag_{ending}"
        with Writer(bag, version=9, storage_plugin=plugin) as writer:
            topic = writer.add_connection("/joint_states", kind, typestore=store)
            for t, q, tau in zip(log["t"], log["q"], log["tau"], strict=True):
                stamp = types["builtin_interfaces/msg/Time"](sec=int(t), nanosec=round(t % 1 * 1e9))
                header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
                names = [f"axis_{i + 1}" for i in range(3)]
                message = types[kind](header=header, name=names, position=q, velocity=0 * q, effort=tau)
                writer.write(topic, round((t + 0.004) * 1e9), store.serialize_cdr(message, kind))
        next(bag.glob(f"*.{ending}")).rename(folder / f"recorded.{ending}")
        for file in bag.iterdir():
            file.unlink()
        bag.rmdir()
